#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/reference/tip.h"

namespace oblique::solver {

/// States of as many cases as the kernel has lanes, side by side (structure of arrays, lane =
/// case), with a chain, a step length and a force law each. Every lane is accepted or refused on
/// its own. While the chains of all lanes are equal, their constants are read once for all.
class LaneStepper {
 public:
  /// For chains of the shape of `chain`, which need not outlive this. All lanes stand idle.
  LaneStepper(const ChainTables<double>& chain, const LaneKernel& kernel);

  std::size_t lanes() const { return kernel_.lanes; }

  /// Puts a state (2 rows entries each) of `chain` into a lane. What `chain` points to must live
  /// until the lane is loaded again or idle.
  void load(std::size_t lane, const ChainTables<double>& chain, const double* q, const double* v);
  /// Makes a lane stand still.
  void idle(std::size_t lane);
  /// Takes the accepted state of a lane out.
  void store(std::size_t lane, double* q, double* v) const;

  void set_step(std::size_t lane, double h_s) {
    if (h_s != arrays_.h_s[lane]) {
      arrays_.h_s[lane] = h_s;
      arrays_.inverse_h_Hz[lane] = h_s > 0.0 ? 1.0 / h_s : 0.0;
    }
  }
  void set_force(std::size_t lane, const AffineContactForce<double>& force);

  /// Steps every lane from its accepted state to a trial state.
  void step();
  /// The tip after that step.
  TipState trial_tip(std::size_t lane, std::size_t tip_row) const {
    const std::size_t x = 2 * tip_row * lanes() + lane;
    const std::size_t y = x + lanes();
    return {arrays_.q_next[x], arrays_.q_next[y], arrays_.v_next[x], arrays_.v_next[y]};
  }
  ContactIntegrals<double> integrals(std::size_t lane) const;
  /// Squared magnitudes of the mean reactions on the links' inner ends over the last step [N^2],
  /// element [link * lanes + lane].
  const double* mean_reactions_squared_N2() const { return arrays_.reactions; }
  /// Makes the trial states accepted in the lanes with accept[lane] != 0; the others stay.
  void settle(std::span<const unsigned char> accept);

 private:
  void compare_chains();

  LaneKernel kernel_;
  std::size_t size_;                                        ///< entries of one state
  std::vector<std::optional<ChainTables<double>>> chains_;  ///< none: the lane is idle
  const ChainTables<double>* one_chain_ = nullptr;  ///< of all lanes that are not idle, if one
  std::vector<unsigned char> is_copied_;            ///< whether side_by_side_ has the lane's chain
  LaneChains side_by_side_;                         ///< all chains, for when they differ
  LaneMemory memory_;
  LaneArrays arrays_{};
};

}  // namespace oblique::solver
