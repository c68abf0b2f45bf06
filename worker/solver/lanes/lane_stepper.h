#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "worker/solver/chain/lane_chains.h"
#include "worker/solver/contact/reaction_peaks.h"
#include "worker/solver/motion/pefrl.h"

namespace oblique::solver {

/// Arrays of one step of all lanes, element [i * lanes + lane]; aligned for the widest vectors.
struct LaneArrays {
  const double* q;
  const double* v;
  double* q_next;
  double* v_next;
  double* scratch;
  const double* h_s;  ///< one a lane
  const double* inverse_h_Hz;
  const double* force;  ///< fn0, ft0, k_nn, k_tn, k_tt, x0, y0: one a lane each
  double* integrals;    ///< impulse_n, impulse_t, work_t: one a lane each
  double* momenta;      ///< scratch for 4 entries a link
  double* reactions;    ///< squared means of the reactions: for each link one a lane
};

/// The PEFRL step compiled for one instruction set: of lanes that share a chain's constants, and of
/// lanes with chains of their own. A lane gets the same bits from both.
struct LaneKernel {
  std::string_view name;  ///< of the instruction set
  std::size_t lanes;
  void (*step_one_chain)(const ChainTables<double>& chain, const LaneArrays& arrays);
  void (*step_chains)(const LaneTables& chains, const LaneArrays& arrays);
  ReactionLoops reaction_loops;
};

/// Kernels that this machine can run, the fastest first; never empty.
std::span<const LaneKernel> runnable_lane_kernels();

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
    if (h_s != h_s_[lane]) {
      h_s_[lane] = h_s;
      inverse_h_Hz_[lane] = h_s > 0.0 ? 1.0 / h_s : 0.0;
    }
  }
  void set_force(std::size_t lane, const AffineContactForce<double>& force);

  /// Steps every lane from its accepted state to a trial state.
  void step();
  /// Entry `i` of a lane's trial coordinates or rates.
  double trial_q(std::size_t lane, std::size_t i) const { return q_next_[i * lanes() + lane]; }
  double trial_v(std::size_t lane, std::size_t i) const { return v_next_[i * lanes() + lane]; }
  ContactIntegrals<double> integrals(std::size_t lane) const;
  /// Squared magnitudes of the mean reactions on the links' inner ends over the last step [N^2],
  /// element [link * lanes + lane].
  const double* mean_reactions_squared_N2() const { return reactions_; }
  /// Makes the trial states accepted in the lanes with accept[lane] != 0; the others stay.
  void settle(std::span<const unsigned char> accept);

 private:
  void compare_chains();

  LaneKernel kernel_;
  std::size_t size_;                                        ///< entries of one state
  std::vector<std::optional<ChainTables<double>>> chains_;  ///< none: the lane is idle
  const ChainTables<double>* one_chain_ = nullptr;  ///< of all lanes that are not idle, if one
  std::optional<LaneChains> side_by_side_;          ///< once it was needed
  std::vector<unsigned char> is_side_by_side_;      ///< whether it holds the lane's chain
  std::vector<double> memory_;
  double* q_;
  double* v_;
  double* q_next_;
  double* v_next_;
  double* scratch_;
  double* h_s_;
  double* inverse_h_Hz_;
  double* force_;
  double* integrals_;
  double* momenta_;
  double* reactions_;
};

}  // namespace oblique::solver
