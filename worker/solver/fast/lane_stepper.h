#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/reference/tip.h"

namespace oblique::solver {

/// One case per lane of the kernel, each with its own chain, step length and force law, stepped by
/// PEFRL. The caller accepts or refuses the step of each lane.
class LaneStepper {
 public:
  /// Makes lanes for chains of the shape of `chain`. All lanes are idle at first.
  LaneStepper(const ChainTables<double>& chain, const LaneKernel& kernel);

  std::size_t lanes() const { return memory_.lanes(); }

  /// Puts a state (q and v, 2 * rows entries each) of `chain` into a lane. The arrays of `chain`
  /// must live until the lane is loaded again or idle.
  void load(std::size_t lane, const ChainTables<double>& chain, const double* q, const double* v);
  /// Gives the lane a step length of 0.
  void idle(std::size_t lane);
  /// Copies the accepted state of a lane to q and v.
  void store(std::size_t lane, double* q, double* v) const;

  void set_step(std::size_t lane, double h_s) { arrays_.h_s[lane] = h_s; }
  void set_force(std::size_t lane, const AffineContactForce<double>& force);

  /// Steps every lane from its accepted state to a trial state.
  void step();
  /// The tip in the trial state.
  TipState trial_tip(std::size_t lane) const {
    const double* x = arrays_.next + 2 * tip_row_ * lanes() + lane;
    const double* vx = x + vector_ * lanes();
    return {x[0], x[lanes()], vx[0], vx[lanes()]};
  }
  ContactIntegrals<double> integrals(std::size_t lane) const;
  /// Squared magnitudes of the mean reactions on the links' inner ends over the last step [N^2],
  /// element [link * lanes + lane].
  const double* mean_reactions_squared_N2() const { return arrays_.reactions; }
  /// Accepts the trial states of the lanes with accept[lane] != 0; the others keep their states.
  void settle(std::span<const unsigned char> accept);

 private:
  void compare_chains();

  LaneKernel kernel_;
  std::size_t vector_;  ///< entries of q, and of v
  std::size_t tip_row_;
  std::vector<std::optional<ChainTables<double>>> chains_;  ///< by lane; empty if idle
  const ChainTables<double>* one_chain_ = nullptr;  ///< set if all busy lanes have the same chain
  LaneMemory memory_;
  LaneTables side_by_side_;  ///< the chains of all lanes
  PefrlArrays arrays_;
};

}  // namespace oblique::solver
