#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "worker/solver/motion/fall_progress.h"
#include "worker/solver/motion/motion.h"

namespace oblique::solver {

/// 100 times the time of a free fall from the chain's length [s]: a fall that lasts longer is none.
double longest_fall_s(const Chain& chain);

/// The free fall from rest up to the instant at which the tip first turns back. One fall passes
/// every drop H, and nothing in it depends on mu, e*, k or eta2. Immutable after construction:
/// states are kept at intervals, and the state at a drop is stepped to from the one before, so its
/// bits do not depend on what was asked before.
class Fall {
 public:
  /// Solves the fall with steps of dt_s up to the first turn of the tip. Throws SolveError when it
  /// diverges, lasts longer than `longest_s` or would take more than 1e9 steps. Tells `progress`,
  /// if there is one, how far it is.
  Fall(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
       FallProgress* progress = nullptr);
  /// The same by the explicit integrator; `longest_s` is 100 times the time of a free fall from
  /// the chain's length. `chain` must outlive this.
  Fall(const Chain& chain, double dt_s);

  /// Largest drop of the tip before it first turns back [m].
  double largest_drop_m() const { return largest_drop_m_; }

  /// The state in which the tip has dropped H_m, located to rounding. Throws InputError when H_m is
  /// not in (0, largest_drop_m()], naming that bound.
  ChainState state_at(double H_m) const;

  /// Memory that its states take.
  std::size_t bytes() const;

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

}  // namespace oblique::solver
