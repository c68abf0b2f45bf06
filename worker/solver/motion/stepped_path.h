#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "worker/solver/motion/fall.h"
#include "worker/solver/motion/fall_progress.h"
#include "worker/solver/motion/motion.h"

namespace oblique::solver {

/// A fall in steps of one length by any integrator. Who takes the steps tells each, in order, and
/// hands over the few states that are wanted; they are kept at intervals, and the state at a drop
/// is stepped to from the one before:
///
///   while (!path.is_over_after_next(tip after one more step)) {
///     if (path.keeps_last()) path.keep(state after it);
///   }
///   path.end(state before the last step);
class SteppedPath : public FallPath {
 public:
  /// Throws SolveError when a fall of `longest_s` would take more than 1e9 steps in
  /// sqrt(2 length/g). Tells `progress`, if there is one, how far it is, until end().
  SteppedPath(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
              FallProgress* progress = nullptr);

  /// Counts a step that has led to `tip`. True when the tip turned back in it. Throws SolveError
  /// when the fall has diverged or lasts longer than it may.
  bool is_over_after_next(const TipState& tip);
  /// Whether the state after the step counted last is wanted.
  bool keeps_last() const { return step_ == next_kept_; }
  /// Keeps that state; its time is set here.
  void keep(ChainState state);
  /// The state before the step in which the tip turned back.
  void end(const ChainState& before);

  double largest_drop_m() const override { return largest_drop_m_; }
  ChainState state_at(double H_m) const override;
  ChainState state_at_time(double t_s) const override;
  std::size_t bytes() const override;

 private:
  double time_s(std::int64_t step) const { return static_cast<double>(step) * dt_s_; }
  /// Steps from `before` to the instant of the drop H_m, which lies within one step of it.
  ChainState locate(double H_m, const ChainState& before) const;

  std::shared_ptr<const Motion> motion_;
  double dt_s_;
  double longest_s_;
  FallProgress* progress_;
  double length_m_;
  double largest_drop_m_ = 0.0;
  std::int64_t step_ = 0;         ///< counted so far
  std::int64_t steps_kept_ = 1;   ///< steps from one kept state to the next
  std::int64_t next_kept_ = 1;    ///< step after which the next is kept
  std::vector<ChainState> kept_;  ///< drops increasing; bounded, whatever the number of steps
};

}  // namespace oblique::solver
