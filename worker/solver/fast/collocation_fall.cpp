#include "worker/solver/fast/collocation_fall.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "worker/solver/fast/lane_falls.h"
#include "worker/solver/model/number.h"

namespace oblique::solver {
namespace {

constexpr std::size_t kStages = GaussCollocation::kStages;
/// Numbers that a fall keeps at most: 16 MB of states and 4 MB of intervals. With fewer states a
/// state at a drop costs more than it should beside a contact; more leave room for fewer falls.
constexpr std::size_t kMostOfStates = (std::size_t{16} << 20) / sizeof(double);
constexpr std::size_t kMostOfIntervals = (std::size_t{4} << 20) / sizeof(double);

/// What the accelerations of the stages do up to the fraction c of a step: v + h sum by_v a and
/// q + c h v + h^2 sum by_q a.
struct DenseWeights {
  explicit DenseWeights(double c) {
    const GaussCollocation& rule = gauss_collocation();
    rule.integrals(c, by_v);
    for (std::size_t k = 0; k < kStages; ++k) {
      by_q[k] = 0.0;
      for (std::size_t j = 0; j < kStages; ++j) {
        by_q[k] += by_v[j] * rule.integral[j][k];
      }
    }
  }
  double by_v[kStages];
  double by_q[kStages];
};

}  // namespace

double TipOverStep::y_m(double c) const {
  const DenseWeights weights(c);
  double shift = 0.0;
  for (std::size_t k = 0; k < kStages; ++k) {
    shift += weights.by_q[k] * ay_m_s2_[k];
  }
  return y_m_ + (c * h_s_ * vy_m_s_ + h_s_ * h_s_ * shift);
}

double TipOverStep::vy_by(const double* weights) const {
  double change = 0.0;
  for (std::size_t k = 0; k < kStages; ++k) {
    change += weights[k] * ay_m_s2_[k];
  }
  return vy_m_s_ + h_s_ * change;
}

double TipOverStep::vy_m_s(double c) const {
  double b[kStages];
  gauss_collocation().integrals(c, b);
  return vy_by(b);
}

double TipOverStep::turn() const {
  const GaussCollocation& rule = gauss_collocation();
  double low = 0.0;
  for (std::size_t place = 0; place <= kStages; ++place) {
    const bool is_stage = place < kStages;
    double high = is_stage ? rule.node[place] : 1.0;
    if (vy_by(is_stage ? rule.integral[place] : rule.weight) < 0.0) {
      low = high;
      continue;
    }
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (vy_m_s(middle) < 0.0 ? low : high) = middle;
    }
    return low;
  }
  return 2.0;
}

double TipOverStep::at_drop(double H_m, double last) const {
  // Newton on the drop, kept inside the step; near the largest drop, where the speed vanishes, it
  // falls back on bisection.
  double low = 0.0;
  double high = last;
  double c = 0.5 * last;
  for (int i = 0; i < 80 && low < high; ++i) {
    const double missing_m = H_m + y_m(c);
    if (missing_m == 0.0) {
      break;
    }
    const double speed = vy_m_s(c);
    (missing_m > 0.0 && speed < 0.0 ? low : high) = c;
    const double newton = c - missing_m / (h_s_ * speed);
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (std::abs(next - c) < 1e-15) {
      break;
    }
    c = next;
  }
  return c;
}

bool CollocationFall::append(const CollocationLanes& lanes, std::size_t lane, double h_s) {
  std::array<double, kStages> ay{};
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    ay[stage] = lanes.stage_a(lane, stage, tip());
  }
  const double y_m = lanes.q(lane, tip());
  const TipOverStep step(h_s, y_m, lanes.v(lane, tip()), ay);
  keep(lanes, lane);
  steps_.push_back({time_s_, -y_m, h_s});
  const double turn = step.turn();
  if (turn <= 1.0) {
    last_turn_ = turn;
    largest_drop_m_ = -step.y_m(turn);
    intervals_.resize((steps_.size() - 1) / steps_kept_ + 1);
    return true;
  }
  time_s_ += h_s;
  return false;
}

void CollocationFall::keep(const CollocationLanes& lanes, std::size_t lane) {
  if (steps_.size() % steps_kept_ != 0) {
    return;
  }
  const std::size_t state = 3 * size();
  lanes.copy_state(lane, states_.emplace_back(state).data());
  if (states_.size() * state <= kMostOfStates) {
    return;
  }
  for (std::size_t i = 1; 2 * i < states_.size(); ++i) {
    states_[i] = std::move(states_[2 * i]);
  }
  states_.resize((states_.size() + 1) / 2);
  steps_kept_ *= 2;
}

std::shared_ptr<const CollocationFall::Interval> CollocationFall::kept_interval(
    std::size_t number) const {
  const std::lock_guard lock(mutex_);
  return intervals_[number];
}

std::shared_ptr<const CollocationFall::Interval> CollocationFall::interval(
    std::size_t number) const {
  if (auto kept = kept_interval(number)) {
    return kept;
  }
  auto solved = solve_again(number);
  const std::lock_guard lock(mutex_);
  if (!intervals_[number] && numbers_ + solved->size() <= kMostOfIntervals) {
    intervals_[number] = solved;
    numbers_ += solved->size();
  }
  return solved;
}

std::shared_ptr<const CollocationFall::Interval> CollocationFall::solve_again(
    std::size_t number) const {
  const std::size_t first = number * steps_kept_;
  const std::size_t last = std::min(first + steps_kept_, steps_.size());
  CollocationLanes lanes(kernel_, chain_);
  const double* start = states_[number].data();
  lanes.set_state(0, start, start + size(), start + 2 * size());
  std::vector<double> h_s(lanes.lanes(), 0.0);
  const std::vector<double> error_m(lanes.lanes(), error_m_);
  std::vector<CollocationLanes::Attempt> attempts(lanes.lanes());
  const std::vector<unsigned char> accept(lanes.lanes(), 1);
  auto interval = std::make_shared<Interval>((last - first) * step_size());
  double* next = interval->data();
  std::vector<double> state(3 * size());
  for (std::size_t step = first; step < last; ++step) {
    h_s[0] = steps_[step].h_s;
    lanes.copy_state(0, state.data());
    lanes.attempt(h_s, error_m, attempts);
    next = std::copy_n(state.data(), 2 * size(), next);
    lanes.copy_stages(0, next);
    next += kStages * size();
    lanes.settle(accept);
  }
  return interval;
}

std::size_t CollocationFall::bytes() const {
  const std::lock_guard lock(mutex_);
  return steps_.size() * sizeof(Step) + sizeof(double) * (states_.size() * 3 * size() + numbers_);
}

ChainState CollocationFall::state_at_drop(double H_m) const {
  const auto after = std::upper_bound(steps_.begin(), steps_.end(), H_m,
                                      [](double H, const Step& step) { return H < step.drop_m; });
  const auto number = static_cast<std::size_t>(after - steps_.begin() - 1);
  const Step& step = steps_[number];
  const auto kept = interval(number / steps_kept_);
  const double* q = kept->data() + number % steps_kept_ * step_size();
  const double* v = q + size();
  const double* stages = v + size();
  std::array<double, kStages> ay{};
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    ay[stage] = stages[stage * size() + tip()];
  }
  const TipOverStep over(step.h_s, q[tip()], v[tip()], ay);
  return within(step, q, over.at_drop(H_m, number + 1 == steps_.size() ? last_turn_ : 1.0));
}

ChainState CollocationFall::state_at_time(double t_s) const {
  const auto after = std::upper_bound(steps_.begin(), steps_.end(), t_s,
                                      [](double t, const Step& step) { return t < step.t_s; });
  const auto number = static_cast<std::size_t>(after - steps_.begin() - 1);
  const Step& step = steps_[number];
  auto numbers = kept_interval(number / steps_kept_);
  if (!numbers) {
    numbers = solve_again(number / steps_kept_);
  }
  const double* q = numbers->data() + number % steps_kept_ * step_size();
  return within(step, q, std::min((t_s - step.t_s) / step.h_s, 1.0));
}

ChainState CollocationFall::within(const Step& step, const double* q, double c) const {
  const double* v = q + size();
  const double* stages = v + size();
  const DenseWeights weights(c);
  ChainState state;
  state.t_s = step.t_s + c * step.h_s;
  state.q.resize(2, chain_.rows());
  state.v.resize(2, chain_.rows());
  const double h_s = step.h_s;
  for (std::size_t i = 0; i < size(); ++i) {
    double by_v = 0.0;
    double by_q = 0.0;
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      by_v += weights.by_v[stage] * stages[stage * size() + i];
      by_q += weights.by_q[stage] * stages[stage * size() + i];
    }
    state.q.data()[i] = q[i] + (c * h_s * v[i] + h_s * h_s * by_q);
    state.v.data()[i] = v[i] + h_s * by_v;
  }
  return state;
}

namespace {

/// A step is as long as leaves this times the accuracy asked for unresolved, in parts of sqrt(g
/// length): README.md.
constexpr double kUnresolved = 1.5;
/// First step, in parts of sqrt(length/g).
constexpr double kFirstStep = 1.0 / 4000.0;
/// No step is longer, in the same parts: the chain turns by some 0.1 then.
constexpr double kLongestStep = 1.0 / 100.0;
/// Newton's method leaves positions this wrong at most, in parts of the length and of the accuracy.
constexpr double kPositionError = 1e-8;
constexpr double kSmallestPositionError = 1e-15;
/// Steps in a fall beyond which it is given up.
constexpr std::size_t kMostSteps = 2'000'000;
/// Halvings in a row after which a fall is given up.
constexpr int kMostHalvings = 30;

/// How long steps are. Changed seldom and by little: while it does not change, the method is
/// symplectic.
class StepControl {
 public:
  StepControl(double timescale_s, double allowed_m_s)
      : h_s_(kFirstStep * timescale_s),
        longest_s_(kLongestStep * timescale_s),
        allowed_m_s_(allowed_m_s) {}

  double h_s() const { return h_s_; }

  /// True when the step is to be taken; false when it is to be tried again with the new h_s().
  bool accepts(const CollocationLanes::Attempt& attempt) {
    const double error = attempt.unresolved_m_s / allowed_m_s_;
    if (!attempt.converged || error > kRefused) {
      ++halvings_;
      change(0.5);
      return false;
    }
    halvings_ = 0;
    mean_square_ += kWeight * (error * error - mean_square_);
    ++steps_;
    const double mean = std::sqrt(mean_square_);
    if (attempt.iterations >= kManyIterations) {
      change(0.8);
    } else if (steps_ >= kPatience && (mean > 1.0 + kBand || mean < 1.0 - kBand)) {
      // What is unresolved falls as h^1.4 where it is vibrations of a released chain.
      change(std::clamp(std::pow(std::max(mean, 1e-6), -0.7), 0.5, 1.5));
    }
    return true;
  }
  bool is_hopeless() const { return halvings_ > kMostHalvings; }

 private:
  static constexpr double kRefused = 4.0;
  static constexpr double kWeight = 0.125;
  static constexpr double kBand = 0.15;
  static constexpr int kPatience = 16;
  static constexpr int kManyIterations = 6;

  void change(double factor) {
    const double longer_s = std::min(factor * h_s_, longest_s_);
    if (longer_s != h_s_) {
      h_s_ = longer_s;
      steps_ = 0;
      mean_square_ = 1.0;
    }
  }

  double h_s_;
  double longest_s_;
  double allowed_m_s_;
  double mean_square_ = 1.0;
  int steps_ = 0;
  int halvings_ = 0;
};

/// A fall on its way, in a lane.
class FallingChain {
 public:
  FallingChain(const LaneKernel& kernel, const FallRequest& request, FallSolution& solution)
      : request_(request),
        solution_(solution),
        length_m_(request.chain->length_m()),
        longest_s_(longest_fall_s(*request.chain)),
        error_m_(length_m_ * std::max(kSmallestPositionError, kPositionError * request.accuracy)),
        fall_(std::make_shared<CollocationFall>(kernel, *request.chain, error_m_)),
        control_(std::sqrt(length_m_ / gravity_m_s2()),
                 kUnresolved * request.accuracy * std::sqrt(length_m_ * gravity_m_s2())) {}

  double h_s() const { return control_.h_s(); }
  double error_m() const { return error_m_; }

  enum class Fate { kAgain, kOn, kOver };
  /// Takes what became of a step: it is to be tried again, or accepted, or the fall is over, one
  /// way or the other.
  Fate take(const CollocationLanes::Attempt& attempt, const CollocationLanes& lanes,
            std::size_t lane) {
    const double h_s = control_.h_s();
    if (!control_.accepts(attempt)) {
      return control_.is_hopeless() ? fail("the fall could not be solved on from t = " +
                                           readable_number(fall_->time_s()) + " s: steps of " +
                                           readable_number(h_s) + " s still do not converge")
                                    : Fate::kAgain;
    }
    const double y_m = lanes.q(lane, 2 * static_cast<std::size_t>(request_.chain->tip_row()) + 1);
    if (!(std::abs(y_m) <= 2.0 * length_m_)) {
      return fail("the fall diverged at t = " + readable_number(fall_->time_s()) + " s");
    }
    if (fall_->append(lanes, lane, h_s)) {
      solution_.fall = fall_;
      return Fate::kOver;
    }
    if (fall_->time_s() > longest_s_) {
      return fail("the tip did not turn back within " + readable_number(longest_s_) +
                  " s of falling");
    }
    if (fall_->steps() >= kMostSteps) {
      return fail("the fall would take more than " + exact_number(static_cast<double>(kMostSteps)) +
                  " steps");
    }
    if (request_.progress != nullptr) {
      request_.progress->store(-y_m, std::memory_order_relaxed);
    }
    return Fate::kOn;
  }

 private:
  double gravity_m_s2() const { return request_.chain->gravity_m_s2(); }
  Fate fail(std::string why) {
    solution_.error = std::move(why);
    return Fate::kOver;
  }

  const FallRequest& request_;
  FallSolution& solution_;
  double length_m_;
  double longest_s_;
  double error_m_;
  std::shared_ptr<CollocationFall> fall_;
  StepControl control_;
};

}  // namespace

std::vector<FallSolution> solve_by_collocation(std::span<const FallRequest> requests,
                                               const LaneKernel& kernel) {
  std::vector<FallSolution> solutions(requests.size());
  if (requests.empty()) {
    return solutions;
  }
  for (const FallRequest& request : requests) {
    if (!have_one_shape(request.chain->tables(), requests.front().chain->tables())) {
      throw std::invalid_argument("falls side by side are of chains of one shape");
    }
  }
  CollocationLanes lanes(kernel, *requests.front().chain);
  std::vector<std::optional<FallingChain>> falling(lanes.lanes());
  std::vector<double> h_s(lanes.lanes());
  std::vector<double> error_m(lanes.lanes());
  std::vector<CollocationLanes::Attempt> attempts(lanes.lanes());
  std::vector<unsigned char> accept(lanes.lanes());
  std::size_t next = 0;
  for (;;) {
    bool any = false;
    for (std::size_t lane = 0; lane < lanes.lanes(); ++lane) {
      std::optional<FallingChain>& here = falling[lane];
      if (!here && next < requests.size()) {
        lanes.load(lane, *requests[next].chain);
        here.emplace(kernel, requests[next], solutions[next]);
        ++next;
      }
      h_s[lane] = here ? here->h_s() : 0.0;
      error_m[lane] = here ? here->error_m() : 0.0;
      any = any || here;
    }
    if (!any) {
      return solutions;
    }
    lanes.attempt(h_s, error_m, attempts);
    for (std::size_t lane = 0; lane < lanes.lanes(); ++lane) {
      accept[lane] = 1;
      if (!falling[lane]) {
        continue;
      }
      const FallingChain::Fate fate = falling[lane]->take(attempts[lane], lanes, lane);
      accept[lane] = fate == FallingChain::Fate::kOn ? 1 : 0;
      if (fate == FallingChain::Fate::kOver) {
        falling[lane].reset();
      }
    }
    lanes.settle(accept);
  }
}

}  // namespace oblique::solver
