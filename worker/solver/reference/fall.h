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

/// Longest fall, relative to the time sqrt(2 length/g) of a free fall from the chain's length.
inline constexpr double kLongestFall = 100.0;
double longest_fall_s(const Chain& chain);

/// Present drop of the tip [m] while a fall is solved, for other threads.
using FallProgress = std::atomic<double>;

/// A solved free fall of a chain, from rest until the tip first turns back. It does not depend on
/// mu, e*, k and eta2. Immutable; may be used by several threads at once.
class Fall {
 public:
  virtual ~Fall() = default;

  /// Drop at which the tip first turns back [m].
  virtual double largest_drop_m() const = 0;

  /// Eq. 20: the state in which the tip has dropped H_m, exact to rounding. Its bits do not depend
  /// on earlier calls. Throws InputError when H_m is not in (0, largest_drop_m()].
  ChainState state_at(double H_m) const;

  /// The state t_s seconds after release, before the tip turns back. A stepped fall may return the
  /// state at the end of a step if t_s is less than a thousandth of a step later.
  virtual ChainState state_at_time(double t_s) const = 0;

  /// Memory of the kept states.
  virtual std::size_t bytes() const = 0;

 private:
  virtual ChainState state_at_drop(double H_m) const = 0;  ///< 0 < H_m <= largest_drop_m()
};

/// Finds the argument in (0, last) at which the tip reaches a drop, by Newton's method within a
/// bracket; near the largest drop, where the speed vanishes, by bisection. `at(c)` returns the
/// missing drop and the rate of the tip's height. Its last call is at the solution. Ends when c
/// changes by less than `tolerance`.
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

/// A fall, or its error.
struct FallSolution {
  std::shared_ptr<const Fall> fall;
  std::string error;
};

/// A fall in equal steps of any integrator. The caller takes the steps and passes the few states
/// that are kept. Steps from the last kept state before a drop give the state at this drop.
class SteppedFall : public Fall {
 public:
  /// Throws SolveError when sqrt(2 length/g) takes more than 1e9 steps. Writes to `progress`, if
  /// not null, until end().
  SteppedFall(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
              FallProgress* progress = nullptr);

  /// Counts a step that ends at `tip`. True if the tip turned back in it. Throws SolveError when
  /// the fall has diverged or lasts longer than `longest_s`.
  bool is_over_after_next(const TipState& tip);
  /// Whether the caller must pass the state after the last step to keep().
  bool keeps_last() const { return step_ == next_kept_; }
  void keep(ChainState state);
  /// Completes the fall. `before` is the state before the step in which the tip turned back.
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
  std::int64_t step_ = 0;         ///< number of steps so far
  std::int64_t steps_kept_ = 1;   ///< number of steps between kept states
  std::int64_t next_kept_ = 1;    ///< step after which a state is kept next
  std::vector<ChainState> kept_;  ///< by increasing drop
};

/// Solves a fall in steps of dt_s. Throws SolveError as SteppedFall does.
std::shared_ptr<const Fall> solve_stepped_fall(const std::shared_ptr<const Motion>& motion,
                                               double dt_s, double longest_s,
                                               FallProgress* progress = nullptr);
/// Solves a fall in explicit steps of dt_s. `chain` must outlive the fall.
std::shared_ptr<const Fall> solve_stepped_fall(const Chain& chain, double dt_s);

}  // namespace oblique::solver
