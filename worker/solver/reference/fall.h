#pragma once

#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "worker/solver/reference/motion.h"

namespace oblique::solver {

/// Longest fall, in units of sqrt(2 length/g).
inline constexpr double kLongestFall = 100.0;

/// kLongestFall times the time of a free fall from the chain's length [s].
double longest_fall_s(const Chain& chain);

/// Drop of the tip so far [m] while a fall is solved, read by another thread.
using FallProgress = std::atomic<double>;

/// A solved free fall of a chain, from rest to the instant at which the tip first turns back. It
/// depends neither on mu, e*, k nor eta2, and passes every drop H (eq. 20). Immutable; may be used
/// by several threads at once.
class Fall {
 public:
  virtual ~Fall() = default;

  /// Largest drop of the tip before it first turns back [m].
  virtual double largest_drop_m() const = 0;

  /// Eq. 20: the state in which the tip has dropped H_m, located to rounding; its bits do not
  /// depend on earlier calls. Throws InputError when H_m is not in (0, largest_drop_m()].
  ChainState state_at(double H_m) const;

  /// The state t_s seconds after release. t_s must not exceed the time of a state that state_at()
  /// returns. A fall that is solved in steps may return the state at the end of the last step
  /// before t_s, if t_s is less than a thousandth of a step later; its time is that of this step.
  virtual ChainState state_at_time(double t_s) const = 0;

  /// Memory of its states.
  virtual std::size_t bytes() const = 0;

 private:
  virtual ChainState state_at_drop(double H_m) const = 0;  ///< 0 < H_m <= largest_drop_m()
};

/// Finds the argument in (0, last) at which the tip has a drop, by Newton's method held by
/// bisection, which takes over near the largest drop, where the speed vanishes. `at(c)` returns
/// what is missing of the drop and the rate of the tip's height; its last call is at the solution.
/// Ends when c changes by less than `tolerance`.
template <class At>
void locate_drop(double last, double tolerance, const At& at) {
  double low = 0.0;
  double high = last;
  double c = 0.5 * last;
  for (int i = 0; i < 80 && low < high; ++i) {
    const auto [missing_m, rate] = at(c);
    if (missing_m == 0.0) {
      return;
    }
    (missing_m > 0.0 && rate < 0.0 ? low : high) = c;
    const double newton = c - missing_m / rate;
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (std::abs(next - c) < tolerance) {
      return;
    }
    c = next;
  }
}

/// A fall, or the reason why there is none.
struct FallSolution {
  std::shared_ptr<const Fall> fall;
  std::string error;
};

/// A fall in steps of one length by any integrator. The caller takes the steps (solve_stepped_fall)
/// and passes the few states that are kept; the state at a drop is stepped to from the one before.
class SteppedFall : public Fall {
 public:
  /// Throws SolveError when sqrt(2 length/g) would take more than 1e9 steps. Reports to `progress`,
  /// if not null, until end().
  SteppedFall(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
              FallProgress* progress = nullptr);

  /// Counts a step that has led to `tip`. True when the tip turned back in it. Throws SolveError
  /// when the fall has diverged or lasts longer than allowed.
  bool is_over_after_next(const TipState& tip);
  /// Whether keep() is to be called with the state after the last step.
  bool keeps_last() const { return step_ == next_kept_; }
  void keep(ChainState state);
  /// The state before the step in which the tip turned back.
  void end(const ChainState& before);

  double largest_drop_m() const override { return largest_drop_m_; }
  ChainState state_at_time(double t_s) const override;
  std::size_t bytes() const override;

 private:
  ChainState state_at_drop(double H_m) const override;
  double time_s(std::int64_t step) const { return static_cast<double>(step) * dt_s_; }

  std::shared_ptr<const Motion> motion_;
  double dt_s_;
  double longest_s_;
  FallProgress* progress_;
  double length_m_;
  double largest_drop_m_ = 0.0;
  std::int64_t step_ = 0;         ///< counted so far
  std::int64_t steps_kept_ = 1;   ///< steps from one kept state to the next
  std::int64_t next_kept_ = 1;    ///< step after which the next is kept
  std::vector<ChainState> kept_;  ///< drops increasing; at most 4096
};

/// Solves a fall in steps of dt_s. Throws SolveError as SteppedFall does.
std::shared_ptr<const Fall> solve_stepped_fall(const std::shared_ptr<const Motion>& motion,
                                               double dt_s, double longest_s,
                                               FallProgress* progress = nullptr);
/// The same by the explicit integrator. `chain` must outlive the fall.
std::shared_ptr<const Fall> solve_stepped_fall(const Chain& chain, double dt_s);

}  // namespace oblique::solver
