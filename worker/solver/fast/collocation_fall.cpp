#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "worker/solver/fast/collocation_lanes.h"
#include "worker/solver/fast/lane_falls.h"
#include "worker/solver/model/number.h"

namespace oblique::solver {
namespace {

constexpr std::size_t kStages = GaussCollocation::kStages;
/// Numbers in the states that a fall keeps at most: 16 MB. With fewer a state at a drop costs more
/// than it should beside a contact; more leave room for fewer falls.
constexpr std::size_t kMostOfStates = (std::size_t{16} << 20) / sizeof(double);
/// A step is as long as leaves this times the accuracy asked for unresolved, in parts of sqrt(g
/// length): collocation.md.
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

/// Position and rate at the fraction c of a step from the accelerations a of its stages:
/// q + (c h v + h^2 sum by_q a) and v + h sum by_v a.
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

double weighted(const double* weights, const double* a) {
  double sum = 0.0;
  for (std::size_t k = 0; k < kStages; ++k) {
    sum += weights[k] * a[k];
  }
  return sum;
}

/// The tip's height over one step: the polynomial through the stages.
struct TipOverStep {
  double h_s;
  CollocationLanes::Entries tip;  ///< of the tip's height

  double start_vy_m_s() const { return tip[1]; }
  const double* ay_m_s2() const { return tip.data() + 3; }

  /// At the fraction c of the step.
  double y_m(double c) const {
    return tip[0] +
           (c * h_s * start_vy_m_s() + h_s * h_s * weighted(DenseWeights(c).by_q, ay_m_s2()));
  }
  double vy_m_s(double c) const {
    double b[kStages];
    gauss_collocation().integrals(c, b);
    return start_vy_m_s() + h_s * weighted(b, ay_m_s2());
  }

  /// Where the tip first stops falling, as a fraction of the step; above 1 when it falls on. It is
  /// looked at in the stages and at the end.
  double turn() const {
    const GaussCollocation& rule = gauss_collocation();
    double low = 0.0;
    for (std::size_t place = 0; place <= kStages; ++place) {
      const bool is_stage = place < kStages;
      double high = is_stage ? rule.node[place] : 1.0;
      const double* weights = is_stage ? rule.integral[place] : rule.weight;
      if (start_vy_m_s() + h_s * weighted(weights, ay_m_s2()) < 0.0) {
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

  /// The fraction in [0, last] at which it has dropped H_m. Newton on the drop, kept inside the
  /// step; near the largest drop, where the speed vanishes, it falls back on bisection.
  double at_drop(double H_m, double last) const {
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
      const double newton = c - missing_m / (h_s * speed);
      const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
      if (std::abs(next - c) < 1e-15) {
        break;
      }
      c = next;
    }
    return c;
  }
};

/// A fall solved by Gauss collocation. The polynomial through the stages of a step gives the states
/// within it. Kept are states at intervals, from which a step is solved again, with the same bits.
class CollocationFall : public Fall {
 public:
  /// `chain` must outlive this. `error_m` is that of the lanes' steps.
  CollocationFall(const LaneKernel& kernel, const Chain& chain, double error_m)
      : kernel_(kernel), chain_(chain), error_m_(error_m) {}

  /// Takes the last attempt of a lane before it is accepted. True when the tip turns within it: the
  /// fall is then complete.
  bool append(const CollocationLanes& lanes, std::size_t lane) {
    const TipOverStep tip_over{lanes.step(lane).h_s, lanes.entries(lane, tip())};
    if (steps_.size() % steps_kept_ == 0) {
      const std::vector<double> numbers = lanes.state_and_stages(lane);
      const auto first = numbers.begin();
      states_.emplace_back(first, first + static_cast<std::ptrdiff_t>(3 * size()));
      thin_states();
    }
    steps_.push_back({time_s_, -tip_over.tip[0], tip_over.h_s});
    const double turn = tip_over.turn();
    if (turn <= 1.0) {
      last_turn_ = turn;
      largest_drop_m_ = -tip_over.y_m(turn);
      return true;
    }
    time_s_ += tip_over.h_s;
    return false;
  }

  double largest_drop_m() const override { return largest_drop_m_; }

  ChainState state_at_time(double t_s) const override {
    const std::size_t number = step_from(t_s, &Step::t_s);
    const Step& step = steps_[number];
    return within(step, solve_again(number), std::min((t_s - step.t_s) / step.h_s, 1.0));
  }

  std::size_t bytes() const override {
    return steps_.size() * sizeof(Step) + sizeof(double) * states_.size() * 3 * size();
  }

  double time_s() const { return time_s_; }
  std::size_t steps() const { return steps_.size(); }

 private:
  struct Step {
    double t_s;  ///< at its begin, as what follows
    double drop_m;
    double h_s;
  };

  ChainState state_at_drop(double H_m) const override {
    const std::size_t number = step_from(H_m, &Step::drop_m);
    const std::vector<double> numbers = solve_again(number);
    const double last = number + 1 == steps_.size() ? last_turn_ : 1.0;
    TipOverStep tip_over{steps_[number].h_s, {}};
    for (std::size_t i = 0; i < tip_over.tip.size(); ++i) {
      tip_over.tip[i] = numbers[i * size() + tip()];
    }
    return within(steps_[number], numbers, tip_over.at_drop(H_m, last));
  }

  /// The last step that begins at `value` of that member or before.
  std::size_t step_from(double value, double Step::*member) const {
    const auto after = std::ranges::upper_bound(steps_, value, {}, member);
    return static_cast<std::size_t>(after - steps_.begin() - 1);
  }

  /// Keeps every second state once they are too many.
  void thin_states() {
    if (states_.size() * 3 * size() <= kMostOfStates) {
      return;
    }
    for (std::size_t i = 1; 2 * i < states_.size(); ++i) {
      states_[i] = std::move(states_[2 * i]);
    }
    states_.resize((states_.size() + 1) / 2);
    steps_kept_ *= 2;
  }

  /// The state before a step, and its stages.
  std::vector<double> solve_again(std::size_t number) const {
    CollocationLanes lanes(kernel_, chain_);
    lanes.set_state(0, states_[number / steps_kept_].data());
    lanes.step(0).error_m = error_m_;
    for (std::size_t step = number / steps_kept_ * steps_kept_;; ++step) {
      lanes.step(0).h_s = steps_[step].h_s;
      lanes.attempt();
      if (step == number) {
        return lanes.state_and_stages(0);
      }
      lanes.accept();
    }
  }

  /// At the fraction c of that step, whose numbers solve_again() gave.
  ChainState within(const Step& step, const std::vector<double>& numbers, double c) const {
    const double* q = numbers.data();
    const double* v = q + size();
    const double* stages = v + 2 * size();
    const DenseWeights weights(c);
    ChainState state;
    state.t_s = step.t_s + c * step.h_s;
    state.q.resize(2, chain_.rows());
    state.v.resize(2, chain_.rows());
    for (std::size_t i = 0; i < size(); ++i) {
      double by_v = 0.0;
      double by_q = 0.0;
      for (std::size_t stage = 0; stage < kStages; ++stage) {
        by_v += weights.by_v[stage] * stages[stage * size() + i];
        by_q += weights.by_q[stage] * stages[stage * size() + i];
      }
      state.q.data()[i] = q[i] + (c * step.h_s * v[i] + step.h_s * step.h_s * by_q);
      state.v.data()[i] = v[i] + step.h_s * by_v;
    }
    return state;
  }

  std::size_t size() const { return 2 * static_cast<std::size_t>(chain_.rows()); }
  std::size_t tip() const { return 2 * static_cast<std::size_t>(chain_.tip_row()) + 1; }

  LaneKernel kernel_;
  const Chain& chain_;
  double error_m_;
  double time_s_ = 0.0;
  double largest_drop_m_ = 0.0;
  double last_turn_ = 1.0;  ///< where the tip turns, as a fraction of the last step
  std::vector<Step> steps_;
  std::size_t steps_kept_ = 2;               ///< steps from one kept state to the next
  std::vector<std::vector<double>> states_;  ///< kept: position, rates, mean acceleration
};

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
  bool accepts(const CollocationLanes::Step& attempt) {
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
        control_(std::sqrt(length_m_ / request.chain->gravity_m_s2()),
                 kUnresolved * request.accuracy *
                     std::sqrt(length_m_ * request.chain->gravity_m_s2())) {}

  /// Sets the lane's next step.
  void set(CollocationLanes::Step& step) const {
    step.h_s = control_.h_s();
    step.error_m = error_m_;
  }

  /// Takes what became of a step, and sets whether it is accepted. True when the fall is over, one
  /// way or the other.
  bool is_over_after(CollocationLanes& lanes, std::size_t lane) {
    CollocationLanes::Step& step = lanes.step(lane);
    step.is_accepted = control_.accepts(step);
    if (!step.is_accepted) {
      return control_.is_hopeless() &&
             fail("the fall could not be solved on from t = " + readable_number(fall_->time_s()) +
                  " s: steps of " + readable_number(step.h_s) + " s still do not converge");
    }
    const auto tip = 2 * static_cast<std::size_t>(request_.chain->tip_row()) + 1;
    const double y_m = lanes.entries(lane, tip)[0];
    if (!(std::abs(y_m) <= 2.0 * length_m_)) {
      return fail("the fall diverged at t = " + readable_number(fall_->time_s()) + " s");
    }
    if (fall_->append(lanes, lane)) {
      solution_.fall = fall_;
      return true;
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
    return false;
  }

 private:
  bool fail(std::string why) {
    solution_.error = std::move(why);
    return true;
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
  std::vector<std::optional<FallingChain>> falling(kernel.lanes);
  for (std::size_t next = 0;;) {
    bool is_any_falling = false;
    for (std::size_t lane = 0; lane < kernel.lanes; ++lane) {
      if (!falling[lane] && next < requests.size()) {
        lanes.load(lane, *requests[next].chain);
        falling[lane].emplace(kernel, requests[next], solutions[next]);
        ++next;
      }
      if (falling[lane]) {
        falling[lane]->set(lanes.step(lane));
        is_any_falling = true;
      }
    }
    if (!is_any_falling) {
      return solutions;
    }
    lanes.attempt();
    for (std::size_t lane = 0; lane < kernel.lanes; ++lane) {
      if (falling[lane] && falling[lane]->is_over_after(lanes, lane)) {
        falling[lane].reset();
        lanes.step(lane) = {.is_accepted = false};
      }
    }
    lanes.accept();
  }
}

}  // namespace oblique::solver
