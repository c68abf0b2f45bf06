#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "worker/solver/reference/motion.h"

namespace oblique::solver {

/// A fall that lasts this many times sqrt(2 length / g) is not one.
inline constexpr double kLongestFall = 100.0;

/// kLongestFall times the time of a free fall from the chain's length [s].
double longest_fall_s(const Chain& chain);

/// Drop of the tip so far [m] while a fall is solved, read by another thread.
using FallProgress = std::atomic<double>;

/// The free fall of a chain from rest up to the instant at which the tip first turns back, solved.
/// One fall passes every drop H (eq. 20), and nothing in it depends on mu, e*, k or eta2.
/// Immutable; may be used by several threads at once.
class Fall {
 public:
  virtual ~Fall() = default;

  /// Largest drop of the tip before it first turns back [m].
  virtual double largest_drop_m() const = 0;

  /// Eq. 20: the state in which the tip has dropped H_m, located to rounding; its bits do not
  /// depend on earlier calls. Throws InputError when H_m is not in (0, largest_drop_m()], naming
  /// that bound.
  ChainState state_at(double H_m) const;

  /// The state t_s seconds after release, for t_s from 0 to the time of a state_at(). A fall in
  /// steps may give the state at the step before, when that is less than a thousandth of a step
  /// away: its time says so. Keeps nothing that bytes() counts.
  virtual ChainState state_at_time(double t_s) const = 0;

  /// Memory that its states take now.
  virtual std::size_t bytes() const = 0;

 private:
  virtual ChainState state_at_drop(double H_m) const = 0;  ///< 0 < H_m <= largest_drop_m()
};

/// A fall, or the reason why there is none.
struct FallSolution {
  std::shared_ptr<const Fall> fall;
  std::string error;
};

/// A fall in steps of one length by any integrator. Whoever takes the steps reports each, in order,
/// and hands over the few states that are kept; the state at a drop is stepped to from the one
/// before:
///
///   while (!fall.is_over_after_next(tip after one more step)) {
///     if (fall.keeps_last()) fall.keep(state after it);
///   }
///   fall.end(state before the last step);
class SteppedFall : public Fall {
 public:
  /// Throws SolveError when a fall of `longest_s` would take more than 1e9 steps in
  /// sqrt(2 length/g). Reports to `progress`, if there is one, until end().
  SteppedFall(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
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
  ChainState state_at_time(double t_s) const override;
  std::size_t bytes() const override;

 private:
  ChainState state_at_drop(double H_m) const override;
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

/// Solves a fall in steps of dt_s. Throws SolveError as SteppedFall does.
std::shared_ptr<const Fall> solve_stepped_fall(const std::shared_ptr<const Motion>& motion,
                                               double dt_s, double longest_s,
                                               FallProgress* progress = nullptr);
/// The same by the explicit integrator. `chain` must outlive the fall.
std::shared_ptr<const Fall> solve_stepped_fall(const Chain& chain, double dt_s);

}  // namespace oblique::solver
