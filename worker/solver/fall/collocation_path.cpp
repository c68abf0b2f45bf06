#include "worker/solver/fall/collocation_path.h"

#include <algorithm>
#include <cmath>

#include "worker/solver/model/errors.h"

namespace oblique::solver {
namespace {

constexpr std::size_t kMostStages = GaussCollocation::kMostStages;
/// Numbers that a fall keeps at most: 16 MB of states and 4 MB of intervals. With fewer states a
/// state at a drop costs more than it should beside a contact; more leave room for fewer falls.
constexpr std::size_t kMostOfStates = (std::size_t{16} << 20) / sizeof(double);
constexpr std::size_t kMostOfIntervals = (std::size_t{4} << 20) / sizeof(double);

/// What the accelerations of the stages do up to the fraction c of a step: v + h sum by_v a and
/// q + c h v + h^2 sum by_q a.
struct DenseWeights {
  DenseWeights(const GaussCollocation& rule, double c) {
    rule.integrals(c, by_v);
    for (std::size_t k = 0; k < rule.stages; ++k) {
      by_q[k] = 0.0;
      for (std::size_t j = 0; j < rule.stages; ++j) {
        by_q[k] += by_v[j] * rule.integral[j][k];
      }
    }
  }
  double by_v[kMostStages];
  double by_q[kMostStages];
};

}  // namespace

double TipOverStep::y_m(double c) const {
  const DenseWeights weights(rule_, c);
  double shift = 0.0;
  for (std::size_t k = 0; k < rule_.stages; ++k) {
    shift += weights.by_q[k] * ay_m_s2_[k];
  }
  return y_m_ + (c * h_s_ * vy_m_s_ + h_s_ * h_s_ * shift);
}

double TipOverStep::vy_by(const double* weights) const {
  double change = 0.0;
  for (std::size_t k = 0; k < rule_.stages; ++k) {
    change += weights[k] * ay_m_s2_[k];
  }
  return vy_m_s_ + h_s_ * change;
}

double TipOverStep::vy_m_s(double c) const {
  double b[kMostStages];
  rule_.integrals(c, b);
  return vy_by(b);
}

double TipOverStep::turn() const {
  double low = 0.0;
  for (std::size_t place = 0; place <= rule_.stages; ++place) {
    const bool is_stage = place < rule_.stages;
    double high = is_stage ? rule_.node[place] : 1.0;
    if (vy_by(is_stage ? rule_.integral[place] : rule_.weight) < 0.0) {
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

bool CollocationPath::append(const CollocationLanes& lanes, std::size_t lane, double h_s) {
  std::array<double, kMostStages> ay{};
  for (std::size_t stage = 0; stage < kernel_.stages; ++stage) {
    ay[stage] = lanes.stage_a(lane, stage, tip());
  }
  const double y_m = lanes.q(lane, tip());
  const TipOverStep step(*rule_, h_s, y_m, lanes.v(lane, tip()), ay);
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

void CollocationPath::keep(const CollocationLanes& lanes, std::size_t lane) {
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

std::shared_ptr<const CollocationPath::Interval> CollocationPath::kept_interval(
    std::size_t number) const {
  const std::lock_guard lock(mutex_);
  return intervals_[number];
}

std::shared_ptr<const CollocationPath::Interval> CollocationPath::interval(
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

std::shared_ptr<const CollocationPath::Interval> CollocationPath::solve_again(
    std::size_t number) const {
  const std::size_t first = number * steps_kept_;
  const std::size_t last = std::min(first + steps_kept_, steps_.size());
  CollocationLanes lanes(kernel_, *rule_, chain_, model_);
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
    next += kernel_.stages * size();
    lanes.settle(accept);
  }
  return interval;
}

std::size_t CollocationPath::bytes() const {
  const std::lock_guard lock(mutex_);
  return steps_.size() * sizeof(Step) + sizeof(double) * (states_.size() * 3 * size() + numbers_);
}

ChainState CollocationPath::state_at(double H_m) const {
  const auto after = std::upper_bound(steps_.begin(), steps_.end(), H_m,
                                      [](double H, const Step& step) { return H < step.drop_m; });
  const auto number = static_cast<std::size_t>(after - steps_.begin() - 1);
  const Step& step = steps_[number];
  const auto kept = interval(number / steps_kept_);
  const double* q = kept->data() + number % steps_kept_ * step_size();
  const double* v = q + size();
  const double* stages = v + size();
  std::array<double, kMostStages> ay{};
  for (std::size_t stage = 0; stage < kernel_.stages; ++stage) {
    ay[stage] = stages[stage * size() + tip()];
  }
  const TipOverStep over(*rule_, step.h_s, q[tip()], v[tip()], ay);
  return within(step, q, over.at_drop(H_m, number + 1 == steps_.size() ? last_turn_ : 1.0));
}

ChainState CollocationPath::state_at_time(double t_s) const {
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

ChainState CollocationPath::within(const Step& step, const double* q, double c) const {
  const double* v = q + size();
  const double* stages = v + size();
  const DenseWeights weights(*rule_, c);
  ChainState state;
  state.t_s = step.t_s + c * step.h_s;
  state.q.resize(2, chain_.rows());
  state.v.resize(2, chain_.rows());
  const double h_s = step.h_s;
  for (std::size_t i = 0; i < size(); ++i) {
    double by_v = 0.0;
    double by_q = 0.0;
    for (std::size_t stage = 0; stage < kernel_.stages; ++stage) {
      by_v += weights.by_v[stage] * stages[stage * size() + i];
      by_q += weights.by_q[stage] * stages[stage * size() + i];
    }
    state.q.data()[i] = q[i] + (c * h_s * v[i] + h_s * h_s * by_q);
    state.v.data()[i] = v[i] + h_s * by_v;
  }
  return state;
}

}  // namespace oblique::solver
