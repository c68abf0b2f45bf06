#include "worker/solver/reference/fall.h"

#include <algorithm>
#include <utility>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::solver {
namespace {

/// When this many states are kept, every second one is dropped. A state has 32 bytes per row.
constexpr std::size_t kMaxKept = 4096;
constexpr double kMaxSteps = 1e9;  ///< steps allowed in the time sqrt(2 length/g); more take hours

}  // namespace

double longest_fall_s(const Chain& chain) {
  return kLongestFall * std::sqrt(2.0 * chain.length_m() / chain.gravity_m_s2());
}

ChainState Fall::state_at(double H_m) const {
  if (!(H_m > 0.0 && H_m <= largest_drop_m())) {
    throw InputError("H = " + exact_number(H_m) +
                     " m is not allowed: the tip of this model drops at most " +
                     readable_number(largest_drop_m(), 7) + " m before it turns back");
  }
  return state_at_drop(H_m);
}

SteppedFall::SteppedFall(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
                         FallProgress* progress)
    : motion_(std::move(motion)), dt_s_(dt_s), longest_s_(longest_s), progress_(progress) {
  if (!(longest_s <= kLongestFall * kMaxSteps * dt_s)) {
    throw SolveError("the fall would take more than " + exact_number(kMaxSteps) +
                     " steps of dt_fall = " + exact_number(dt_s) + " s");
  }
  kept_.push_back(motion_->at_rest());
  length_m_ = motion_->tip(kept_.front()).x_m;
}

bool SteppedFall::is_over_after_next(const TipState& tip) {
  // Times are products, because sums would accumulate rounding.
  const double t_s = time_s(++step_);
  if (!std::isfinite(tip.y_m) || std::abs(tip.y_m) > 2.0 * length_m_) {
    throw SolveError("the fall diverged at t = " + readable_number(t_s) +
                     " s with dt_fall = " + exact_number(dt_s_) + " s");
  }
  if (tip.vy_m_s >= 0.0) {
    return true;
  }
  if (t_s > longest_s_) {
    throw SolveError("the tip did not turn back within " + readable_number(longest_s_) +
                     " s of falling");
  }
  if (progress_ != nullptr && keeps_last()) {
    progress_->store(-tip.y_m, std::memory_order_relaxed);
  }
  return false;
}

void SteppedFall::end(const ChainState& before) {
  progress_ = nullptr;
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

void SteppedFall::keep(ChainState state) {
  state.t_s = time_s(step_);
  kept_.push_back(std::move(state));
  next_kept_ += steps_kept_;
  if (kept_.size() < kMaxKept) {
    return;
  }
  for (std::size_t i = 1; 2 * i < kept_.size(); ++i) {
    kept_[i] = std::move(kept_[2 * i]);
  }
  kept_.resize((kept_.size() + 1) / 2);
  steps_kept_ *= 2;
  next_kept_ = (step_ / steps_kept_ + 1) * steps_kept_;
}

ChainState SteppedFall::state_at_drop(double H_m) const {
  const auto drop = [this](const ChainState& state) { return -motion_->tip(state).y_m; };
  auto after = std::upper_bound(kept_.begin(), kept_.end(), H_m,
                                [&](double H, const ChainState& state) { return H < drop(state); });
  ChainState before = *(after - 1);
  ChainState state = before;
  const auto first_step = static_cast<std::int64_t>(after - kept_.begin() - 1) * steps_kept_;
  for (std::int64_t step = 1; step <= steps_kept_; ++step) {
    std::swap(before, state);
    motion_->step(before, kNoContact, dt_s_, state);
    state.t_s = time_s(first_step + step);
    if (drop(state) >= H_m || motion_->tip(state).vy_m_s >= 0.0) {
      break;
    }
  }
  locate_drop(dt_s_, 1e-18, [&](double h_s) {
    motion_->step(before, kNoContact, h_s, state);
    const TipState tip = motion_->tip(state);
    return std::pair(H_m + tip.y_m, tip.vy_m_s);
  });
  return state;
}

ChainState SteppedFall::state_at_time(double t_s) const {
  auto last_step = static_cast<std::int64_t>(t_s / dt_s_);
  last_step -= time_s(last_step) > t_s ? 1 : 0;  // if the quotient was rounded up
  const auto number =
      std::min<std::int64_t>(last_step / steps_kept_, static_cast<std::int64_t>(kept_.size()) - 1);
  ChainState state = kept_[static_cast<std::size_t>(number)];
  ChainState before;
  for (std::int64_t step = number * steps_kept_; step < last_step; ++step) {
    std::swap(before, state);
    motion_->step(before, kNoContact, dt_s_, state);
  }
  state.t_s = time_s(last_step);
  const double h_s = t_s - state.t_s;
  // Shorter implicit steps would amplify rounding, because they divide by h^2.
  if (h_s > 1e-3 * dt_s_) {
    std::swap(before, state);
    motion_->step(before, kNoContact, h_s, state);
  }
  return state;
}

std::size_t SteppedFall::bytes() const {
  const ChainState& state = kept_.front();
  const auto numbers = state.q.size() + state.v.size() + state.acceleration.size() +
                       state.algorithmic_offset_rate.size() + state.multipliers_N.size();
  return kept_.size() * (sizeof(ChainState) + static_cast<std::size_t>(numbers) * sizeof(double));
}

std::shared_ptr<const Fall> solve_stepped_fall(const std::shared_ptr<const Motion>& motion,
                                               double dt_s, double longest_s,
                                               FallProgress* progress) {
  auto fall = std::make_shared<SteppedFall>(motion, dt_s, longest_s, progress);
  ChainState before = motion->at_rest();
  ChainState state = before;
  for (;;) {
    motion->step(before, kNoContact, dt_s, state);
    if (fall->is_over_after_next(motion->tip(state))) {
      fall->end(before);
      return fall;
    }
    if (fall->keeps_last()) {
      fall->keep(state);
    }
    std::swap(before, state);
  }
}

std::shared_ptr<const Fall> solve_stepped_fall(const Chain& chain, double dt_s) {
  return solve_stepped_fall(std::make_shared<ExplicitMotion>(chain), dt_s, longest_fall_s(chain));
}

}  // namespace oblique::solver
