#include "worker/solver/motion/fall.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::solver {
namespace {

/// Most states kept. A state costs 32 bytes a row; when there are more, every other one goes.
constexpr std::size_t kMostKept = 4096;
/// A fall that lasts this many times sqrt(2 length / g) is not one.
constexpr double kLongestFall = 100.0;
/// Steps in sqrt(2 length / g) beyond which a fall is not begun: it would take hours.
constexpr double kMostSteps = 1e9;

constexpr AffineContactForce<double> kNoContact{};

/// Steps of one length by any integrator. States are kept at intervals, and the state at a drop is
/// stepped to from the one before.
class SteppedPath : public FallPath {
 public:
  SteppedPath(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
              FallProgress* progress);
  double largest_drop_m() const override { return largest_drop_m_; }
  ChainState state_at(double H_m) const override;
  std::size_t bytes() const override;

 private:
  void locate_turn(const ChainState& before);
  void keep(std::int64_t step, const ChainState& state);
  /// Steps from `before` to the instant of the drop H_m, which lies within one step of it.
  ChainState locate(double H_m, const ChainState& before) const;

  std::shared_ptr<const Motion> motion_;
  double dt_s_;
  double largest_drop_m_ = 0.0;
  std::int64_t steps_kept_ = 1;   ///< steps from one kept state to the next
  std::vector<ChainState> kept_;  ///< drops increasing; bounded, whatever the number of steps
};

SteppedPath::SteppedPath(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
                         FallProgress* progress)
    : motion_(std::move(motion)), dt_s_(dt_s) {
  if (!(longest_s <= kLongestFall * kMostSteps * dt_s)) {
    throw SolveError("the fall would take more than " + exact_number(kMostSteps) +
                     " steps of dt_fall = " + exact_number(dt_s) + " s");
  }
  ChainState before = motion_->at_rest();
  ChainState state = before;
  const double length_m = motion_->tip(state).x_m;
  kept_.push_back(state);
  for (std::int64_t step = 1;; ++step) {
    motion_->step(before, kNoContact, dt_s, state);
    // Times are products, not sums: a long fall would otherwise gather rounding.
    state.t_s = static_cast<double>(step) * dt_s;
    const TipState tip = motion_->tip(state);
    if (!std::isfinite(tip.y_m) || std::abs(tip.y_m) > 2.0 * length_m) {
      throw SolveError("the fall diverged at t = " + readable_number(state.t_s) +
                       " s with dt_fall = " + exact_number(dt_s) + " s");
    }
    if (tip.vy_m_s >= 0.0) {
      locate_turn(before);
      return;
    }
    if (state.t_s > longest_s) {
      throw SolveError("the tip did not turn back within " + readable_number(longest_s) +
                       " s of falling");
    }
    if (progress != nullptr) {
      progress->reach(state.t_s, -tip.y_m);
    }
    keep(step, state);
    std::swap(before, state);
  }
}

void SteppedPath::locate_turn(const ChainState& before) {
  ChainState state;
  const auto tip_after = [&](double h_s) {
    motion_->step(before, kNoContact, h_s, state);
    return motion_->tip(state);
  };
  double low = 0.0;
  double high = dt_s_;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (tip_after(middle).vy_m_s < 0.0 ? low : high) = middle;
  }
  largest_drop_m_ = -tip_after(low).y_m;
}

void SteppedPath::keep(std::int64_t step, const ChainState& state) {
  if (step % steps_kept_ != 0) {
    return;
  }
  kept_.push_back(state);
  if (kept_.size() < kMostKept) {
    return;
  }
  for (std::size_t i = 1; 2 * i < kept_.size(); ++i) {
    kept_[i] = std::move(kept_[2 * i]);
  }
  kept_.resize((kept_.size() + 1) / 2);
  steps_kept_ *= 2;
}

ChainState SteppedPath::state_at(double H_m) const {
  const auto drop = [this](const ChainState& state) { return -motion_->tip(state).y_m; };
  auto after = std::upper_bound(kept_.begin(), kept_.end(), H_m,
                                [&](double H, const ChainState& state) { return H < drop(state); });
  ChainState before = *(after - 1);
  ChainState state = before;
  const auto first_step = static_cast<std::int64_t>(after - kept_.begin() - 1) * steps_kept_;
  for (std::int64_t step = 1; step <= steps_kept_; ++step) {
    std::swap(before, state);
    motion_->step(before, kNoContact, dt_s_, state);
    state.t_s = static_cast<double>(first_step + step) * dt_s_;
    if (drop(state) >= H_m || motion_->tip(state).vy_m_s >= 0.0) {
      break;
    }
  }
  return locate(H_m, before);
}

std::size_t SteppedPath::bytes() const {
  const auto numbers = [](const ChainState& state) {
    return state.q.size() + state.v.size() + state.acceleration.size() +
           state.algorithmic_offset_rate.size() + state.multipliers_N.size();
  };
  const auto a_state = static_cast<std::size_t>(numbers(kept_.front())) * sizeof(double);
  return kept_.size() * (sizeof(ChainState) + a_state);
}

ChainState SteppedPath::locate(double H_m, const ChainState& before) const {
  // Newton on the drop, kept inside the step; near the largest drop, where the speed vanishes, it
  // falls back on bisection.
  double low = 0.0;
  double high = dt_s_;
  double h = 0.5 * dt_s_;
  ChainState state = before;
  for (int i = 0; i < 80 && high - low > 0.0; ++i) {
    motion_->step(before, kNoContact, h, state);
    const TipState tip = motion_->tip(state);
    const double missing_m = H_m + tip.y_m;
    if (missing_m == 0.0) {
      break;
    }
    const bool is_before = missing_m > 0.0 && tip.vy_m_s < 0.0;
    (is_before ? low : high) = h;
    const double newton = h - missing_m / tip.vy_m_s;
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (next == h || std::abs(next - h) < 1e-18) {
      break;
    }
    h = next;
  }
  return state;
}

}  // namespace

double longest_fall_s(const Chain& chain) {
  const double length_m = chain.tip(chain.at_rest()).x_m;
  return kLongestFall * std::sqrt(2.0 * length_m / chain.gravity_m_s2());
}

Fall::Fall(const Chain& chain, double dt_s)
    : Fall(std::make_shared<ExplicitMotion>(chain), dt_s, longest_fall_s(chain)) {}

Fall::Fall(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
           FallProgress* progress)
    : path_(std::make_shared<SteppedPath>(std::move(motion), dt_s, longest_s, progress)) {}

ChainState Fall::state_at(double H_m) const {
  if (!(H_m > 0.0 && H_m <= largest_drop_m())) {
    throw InputError("H = " + exact_number(H_m) +
                     " m is not allowed: the tip of this model drops at most " +
                     readable_number(largest_drop_m(), 7) + " m before it turns back");
  }
  return path_->state_at(H_m);
}

}  // namespace oblique::solver
