#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "worker/solver/motion/fall_progress.h"
#include "worker/solver/motion/motion.h"

namespace oblique::solver {

/// A fall that lasts this many times sqrt(2 length / g) is not one.
inline constexpr double kLongestFall = 100.0;

/// kLongestFall times the time of a free fall from the chain's length [s].
double longest_fall_s(const Chain& chain);

/// The way of a chain from rest to the first turn of its tip, solved. Immutable.
class FallPath {
 public:
  virtual ~FallPath() = default;
  /// Largest drop of the tip before it first turns back [m].
  virtual double largest_drop_m() const = 0;
  /// As Fall::state_at, for 0 < H_m <= largest_drop_m().
  virtual ChainState state_at(double H_m) const = 0;
  /// The state t_s seconds after release, for t_s from 0 to the time of a state_at(). A path that
  /// takes steps may give the state at the step before, when that is less than a thousandth of a
  /// step away: its time says so. Keeps nothing that bytes() counts.
  virtual ChainState state_at_time(double t_s) const = 0;
  /// Memory that its states take now.
  virtual std::size_t bytes() const = 0;
};

/// A fall, or the reason why there is none.
struct FallSolution {
  std::shared_ptr<const FallPath> path;
  std::string error;
};

/// The free fall from rest up to the instant at which the tip first turns back. One fall passes
/// every drop H, and nothing in it depends on mu, e*, k or eta2. Immutable; a copy is the same
/// fall.
class Fall {
 public:
  explicit Fall(std::shared_ptr<const FallPath> path) : path_(std::move(path)) {}
  /// Solves the fall with steps of dt_s up to the first turn of the tip. Throws SolveError when it
  /// diverges, lasts longer than `longest_s` or would take more than 1e9 steps. Tells `progress`,
  /// if there is one, how far it is.
  Fall(std::shared_ptr<const Motion> motion, double dt_s, double longest_s,
       FallProgress* progress = nullptr);
  /// The same by the explicit integrator; `longest_s` is 100 times the time of a free fall from
  /// the chain's length. `chain` must outlive this.
  Fall(const Chain& chain, double dt_s);

  /// Largest drop of the tip before it first turns back [m].
  double largest_drop_m() const { return path_->largest_drop_m(); }

  /// The state in which the tip has dropped H_m, located to rounding; its bits do not depend on
  /// what was asked before. Throws InputError when H_m is not in (0, largest_drop_m()], naming that
  /// bound.
  ChainState state_at(double H_m) const;

  /// Memory that its states take now.
  std::size_t bytes() const { return path_->bytes(); }
  const std::shared_ptr<const FallPath>& path() const { return path_; }

 private:
  std::shared_ptr<const FallPath> path_;
};

}  // namespace oblique::solver
