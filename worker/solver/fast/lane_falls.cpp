#include "worker/solver/fast/lane_falls.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <numeric>
#include <optional>
#include <utility>

#include "worker/solver/fast/collocation_lanes.h"
#include "worker/solver/fast/lane_stepper.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::solver {
namespace {

constexpr std::size_t kStages = GaussCollocation::kStages;
/// Maximum size of the states that a fall keeps: 16 MB. With fewer states, finding the state at a
/// drop takes long compared to a contact; with more, memory holds fewer falls.
constexpr std::size_t kMaxOfStates = (std::size_t{16} << 20) / sizeof(double);
/// Allowed unresolved speed of a step, relative to accuracy times sqrt(g length) (collocation.md).
constexpr double kUnresolved = 1.5;
/// First step, relative to sqrt(length/g).
constexpr double kFirstStep = 1.0 / 4000.0;
/// Longest step, relative to sqrt(length/g): the chain turns by about 0.1 rad in it.
constexpr double kLongestStep = 1.0 / 100.0;
/// Allowed error of positions in Newton's method, relative to length times requested accuracy.
constexpr double kPositionError = 1e-8;
constexpr double kSmallestPositionError = 1e-15;
constexpr std::size_t kMaxSteps = 2'000'000;
constexpr int kMaxHalvings = 30;  ///< maximum number of consecutive halvings of a step

/// Solves falls side by side; a lane whose fall is complete takes the next request. `Lanes` is
/// SteppedLanes or CollocationFalls. An exception of start() or judge() becomes the fall's error.
template <class Lanes>
std::vector<FallSolution> solve_side_by_side(std::span<const FallRequest> requests, Lanes& lanes) {
  std::vector<FallSolution> solutions(requests.size());
  std::vector<std::optional<std::size_t>> falling(lanes.lanes());  // numbers of requests
  // Calls `work`; frees the lane if its fall is then complete or has failed.
  const auto attempt = [&](std::size_t lane, const auto& work) {
    FallSolution& solution = solutions[*falling[lane]];
    try {
      work(solution);
    } catch (const std::exception& error) {
      solution.error = error.what();
    }
    if (solution.fall || !solution.error.empty()) {
      falling[lane].reset();
      lanes.idle(lane);
    }
  };
  for (std::size_t next = 0;;) {
    bool is_any_falling = false;
    for (std::size_t lane = 0; lane < falling.size(); ++lane) {
      while (!falling[lane] && next < requests.size()) {
        falling[lane] = next++;
        attempt(lane, [&](FallSolution&) { lanes.start(lane, requests[*falling[lane]]); });
      }
      is_any_falling = is_any_falling || falling[lane];
    }
    if (!is_any_falling) {
      return solutions;
    }
    lanes.step();
    for (std::size_t lane = 0; lane < falling.size(); ++lane) {
      if (falling[lane]) {
        attempt(lane, [&](FallSolution& solution) { solution.fall = lanes.judge(lane); });
      }
    }
    lanes.settle();
  }
}

/// Falls by explicit steps, one per lane. All lanes are idle at first.
class SteppedLanes {
 public:
  SteppedLanes(const Chain& shape, const LaneKernel& kernel)
      : stepper_(shape.tables(), kernel),
        falls_(kernel.lanes),
        all_(kernel.lanes, 1),
        column_(shape.at_rest()) {}

  std::size_t lanes() const { return falls_.size(); }

  void start(std::size_t lane, const FallRequest& request) {
    falls_[lane] = std::make_shared<SteppedFall>(request.motion, request.dt_s,
                                                 longest_fall_s(*request.chain), request.progress);
    const ChainState rest = request.chain->at_rest();
    stepper_.load(lane, request.chain->tables(), rest.q.data(), rest.v.data());
    stepper_.set_step(lane, request.dt_s);
    stepper_.set_force(lane, {});
  }
  void step() { stepper_.step(); }
  /// To be called after each step. Returns the lane's fall if it is complete, else nullptr.
  std::shared_ptr<const Fall> judge(std::size_t lane) {
    if (!falls_[lane]->is_over_after_next(stepper_.trial_tip(lane))) {
      return nullptr;
    }
    falls_[lane]->end(stored(lane));
    return falls_[lane];
  }
  void idle(std::size_t lane) {
    falls_[lane].reset();
    stepper_.idle(lane);
  }
  /// Accepts the step.
  void settle() {
    stepper_.settle(all_);
    for (std::size_t lane = 0; lane < lanes(); ++lane) {
      if (falls_[lane] && falls_[lane]->keeps_last()) {
        falls_[lane]->keep(stored(lane));
      }
    }
  }

 private:
  const ChainState& stored(std::size_t lane) {
    stepper_.store(lane, column_.q.data(), column_.v.data());
    return column_;
  }

  LaneStepper stepper_;
  std::vector<std::shared_ptr<SteppedFall>> falls_;
  std::vector<unsigned char> all_;  ///< 1 for every lane: settle() accepts all steps
  ChainState column_;
};

/// Weights of the accelerations a at the stages: at the fraction c of a step the position is
/// q + c h v + h^2 sum by_q a and the rate is v + h sum by_v a.
struct DenseWeights {
  explicit DenseWeights(double fraction) : c(fraction) {
    const GaussCollocation& rule = gauss_collocation();
    rule.integrals(c, by_v);
    for (std::size_t k = 0; k < kStages; ++k) {
      by_q[k] = 0.0;
      for (std::size_t j = 0; j < kStages; ++j) {
        by_q[k] += by_v[j] * rule.integral[j][k];
      }
    }
  }
  double c;
  double by_v[kStages];
  double by_q[kStages];
};

using Coordinate = CollocationLanes::Coordinate;

double position(const Coordinate& at, const DenseWeights& weights) {
  const double sum = std::inner_product(at.a.begin(), at.a.end(), weights.by_q, 0.0);
  return at.q + (weights.c * at.h_s * at.v + at.h_s * at.h_s * sum);
}

double rate(const Coordinate& at, const double* by_v) {
  return at.v + at.h_s * std::inner_product(at.a.begin(), at.a.end(), by_v, 0.0);
}

/// Fraction of the step at which the height y first stops falling; above 1 if it falls at all
/// stages and at the end.
double turn_of(const Coordinate& y) {
  const GaussCollocation& rule = gauss_collocation();
  double low = 0.0;
  for (std::size_t place = 0; place <= kStages; ++place) {
    const bool is_stage = place < kStages;
    double high = is_stage ? rule.node[place] : 1.0;
    if (rate(y, is_stage ? rule.integral[place] : rule.weight) < 0.0) {
      low = high;
      continue;
    }
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (rate(y, DenseWeights(middle).by_v) < 0.0 ? low : high) = middle;
    }
    return low;
  }
  return 2.0;
}

/// A fall solved by Gauss collocation. It keeps the lengths of all steps and some states, from
/// which it solves steps again with the same bits.
class CollocationFall : public Fall {
 public:
  /// `chain` must outlive this. `error_m` as in CollocationLanes::Step.
  CollocationFall(const LaneKernel& kernel, const Chain& chain, double error_m)
      : kernel_(kernel), chain_(chain), error_m_(error_m) {}

  /// Adds a step that a lane has solved but not accepted. True if the tip turns within the step,
  /// and so the fall is complete.
  bool append(const CollocationLanes& lanes, std::size_t lane, const Coordinate& tip_y) {
    if (steps_.size() % steps_kept_ == 0) {
      states_.push_back(lanes.state(lane));
      thin_states();
    }
    steps_.push_back({time_s_, -tip_y.q, tip_y.h_s});
    const double turn = turn_of(tip_y);
    if (turn <= 1.0) {
      last_turn_ = turn;
      largest_drop_m_ = -position(tip_y, DenseWeights(turn));
      return true;
    }
    time_s_ += tip_y.h_s;
    return false;
  }

  double largest_drop_m() const override { return largest_drop_m_; }

  ChainState state_at_time(double t_s) const override {
    const std::size_t number = step_from(t_s, &Step::t_s);
    const Step& step = steps_[number];
    return within(number, solve_again(number), std::min((t_s - step.t_s) / step.h_s, 1.0));
  }

  std::size_t bytes() const override {
    return steps_.size() * sizeof(Step) + sizeof(double) * states_.size() * states_.front().size();
  }

  /// Duration of the steps so far.
  double time_s() const { return time_s_; }
  std::size_t steps() const { return steps_.size(); }
  /// Index of the coordinate that is the tip's height.
  std::size_t tip_y() const { return 2 * static_cast<std::size_t>(chain_.tip_row()) + 1; }

 private:
  struct Step {
    double t_s;     ///< at the start
    double drop_m;  ///< at the start
    double h_s;
  };

  ChainState state_at_drop(double H_m) const override {
    const std::size_t number = step_from(H_m, &Step::drop_m);
    const std::vector<Coordinate> step = solve_again(number);
    const double last = number + 1 == steps_.size() ? last_turn_ : 1.0;
    const Coordinate& y = step[tip_y()];
    double at = 0.0;
    locate_drop(last, 1e-15, [&](double c) {
      at = c;
      const DenseWeights weights(c);
      return std::pair(H_m + position(y, weights), y.h_s * rate(y, weights.by_v));
    });
    return within(number, step, at);
  }

  /// Returns the last step at whose start `member` is at most `value`.
  std::size_t step_from(double value, double Step::*member) const {
    const auto after = std::ranges::upper_bound(steps_, value, {}, member);
    return static_cast<std::size_t>(after - steps_.begin() - 1);
  }

  /// Drops every second state if the states need too much memory.
  void thin_states() {
    if (states_.size() * states_.front().size() <= kMaxOfStates) {
      return;
    }
    for (std::size_t i = 1; 2 * i < states_.size(); ++i) {
      states_[i] = std::move(states_[2 * i]);
    }
    states_.resize((states_.size() + 1) / 2);
    steps_kept_ *= 2;
  }

  std::vector<Coordinate> solve_again(std::size_t number) const {
    CollocationLanes lanes(kernel_, chain_);
    lanes.set_state(0, states_[number / steps_kept_]);
    lanes.step(0).error_m = error_m_;
    for (std::size_t step = number / steps_kept_ * steps_kept_;; ++step) {
      lanes.step(0).h_s = steps_[step].h_s;
      lanes.attempt();
      if (step == number) {
        break;
      }
      lanes.accept();
    }
    std::vector<Coordinate> coordinates;
    for (std::size_t i = 0; i < lanes.coordinates(); ++i) {
      coordinates.push_back(lanes.coordinate(0, i));
    }
    return coordinates;
  }

  /// The state at the fraction c of step `number`.
  ChainState within(std::size_t number, const std::vector<Coordinate>& step, double c) const {
    const DenseWeights weights(c);
    ChainState state;
    state.t_s = steps_[number].t_s + c * steps_[number].h_s;
    state.q.resize(2, chain_.rows());
    state.v.resize(2, chain_.rows());
    for (std::size_t i = 0; i < step.size(); ++i) {
      state.q.data()[i] = position(step[i], weights);
      state.v.data()[i] = rate(step[i], weights.by_v);
    }
    return state;
  }

  LaneKernel kernel_;
  const Chain& chain_;
  double error_m_;
  double time_s_ = 0.0;
  double largest_drop_m_ = 0.0;
  double last_turn_ = 1.0;  ///< fraction of the last step at which the tip turns
  std::vector<Step> steps_;
  std::size_t steps_kept_ = 2;               ///< number of steps between kept states
  std::vector<std::vector<double>> states_;  ///< position, rates, mean acceleration
};

/// Chooses the step length. Changes it seldom and little: only constant steps are symplectic.
class StepControl {
 public:
  StepControl(double length_m, double gravity_m_s2, double accuracy)
      : h_s_(kFirstStep * std::sqrt(length_m / gravity_m_s2)),
        longest_s_(kLongestStep * std::sqrt(length_m / gravity_m_s2)),
        allowed_m_s_(kUnresolved * accuracy * std::sqrt(length_m * gravity_m_s2)) {}

  double h_s() const { return h_s_; }

  /// True if the step is accepted; false if it must be repeated with the new h_s().
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
      // For the vibrations of a released chain the unresolved speed is proportional to h^1.4.
      change(std::clamp(std::pow(std::max(mean, 1e-6), -0.7), 0.5, 1.5));
    }
    return true;
  }
  bool is_hopeless() const { return halvings_ > kMaxHalvings; }

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

/// Falls by collocation, one per lane.
class CollocationFalls {
 public:
  CollocationFalls(const Chain& shape, const LaneKernel& kernel)
      : kernel_(kernel), lanes_(kernel, shape), falling_(kernel.lanes) {}

  std::size_t lanes() const { return falling_.size(); }

  void start(std::size_t lane, const FallRequest& request) {
    const Chain& chain = *request.chain;
    const double length_m = chain.length_m();
    const double error_m =
        length_m * std::max(kSmallestPositionError, kPositionError * request.accuracy);
    lanes_.load(lane, chain);
    lanes_.step(lane).error_m = error_m;
    falling_[lane] = {length_m, longest_fall_s(chain), request.progress,
                      std::make_shared<CollocationFall>(kernel_, chain, error_m),
                      StepControl(length_m, chain.gravity_m_s2(), request.accuracy)};
  }
  void step() {
    for (std::size_t lane = 0; lane < lanes(); ++lane) {
      if (falling_[lane]) {
        lanes_.step(lane).h_s = falling_[lane]->control.h_s();
      }
    }
    lanes_.attempt();
  }
  std::shared_ptr<const Fall> judge(std::size_t lane) {
    CollocationLanes::Step& step = lanes_.step(lane);
    auto& [length_m, longest_s, progress, fall, control] = *falling_[lane];
    step.is_accepted = control.accepts(step);
    if (!step.is_accepted) {
      if (control.is_hopeless()) {
        throw SolveError(
            "the fall could not be solved on from t = " + readable_number(fall->time_s()) +
            " s: steps of " + readable_number(step.h_s) + " s still do not converge");
      }
      return nullptr;
    }
    const Coordinate tip_y = lanes_.coordinate(lane, fall->tip_y());
    if (!(std::abs(tip_y.q) <= 2.0 * length_m)) {
      throw SolveError("the fall diverged at t = " + readable_number(fall->time_s()) + " s");
    }
    if (fall->append(lanes_, lane, tip_y)) {
      return fall;
    }
    if (fall->time_s() > longest_s) {
      throw SolveError("the tip did not turn back within " + readable_number(longest_s) +
                       " s of falling");
    }
    if (fall->steps() >= kMaxSteps) {
      throw SolveError("the fall would take more than " +
                       exact_number(static_cast<double>(kMaxSteps)) + " steps");
    }
    if (progress != nullptr) {
      progress->store(-tip_y.q, std::memory_order_relaxed);
    }
    return nullptr;
  }
  void idle(std::size_t lane) {
    falling_[lane].reset();
    lanes_.step(lane) = {.is_accepted = false};
  }
  void settle() { lanes_.accept(); }

 private:
  struct Falling {
    double length_m;
    double longest_s;
    FallProgress* progress;
    std::shared_ptr<CollocationFall> fall;
    StepControl control;
  };

  LaneKernel kernel_;
  CollocationLanes lanes_;
  std::vector<std::optional<Falling>> falling_;
};

}  // namespace

std::vector<FallSolution> solve_by_steps(std::span<const FallRequest> requests,
                                         const LaneKernel& kernel) {
  if (requests.empty()) {
    return {};
  }
  SteppedLanes lanes(*requests.front().chain, kernel);
  return solve_side_by_side(requests, lanes);
}

std::vector<FallSolution> solve_by_collocation(std::span<const FallRequest> requests,
                                               const LaneKernel& kernel) {
  if (requests.empty()) {
    return {};
  }
  CollocationFalls lanes(*requests.front().chain, kernel);
  return solve_side_by_side(requests, lanes);
}

}  // namespace oblique::solver
