#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/reference/chain.h"

namespace oblique::solver {

/// Chains of one shape that fall side by side, one a lane, each with constants and a step length of
/// its own. A lane's bits do not depend on the others.
class CollocationLanes {
 public:
  /// Lanes for chains of the shape of `chain`. Each holds `chain` at rest.
  CollocationLanes(const LaneKernel& kernel, const Chain& chain);
  CollocationLanes(const CollocationLanes&) = delete;
  CollocationLanes& operator=(const CollocationLanes&) = delete;
  ~CollocationLanes() = default;

  std::size_t lanes() const { return kernel_.lanes; }
  /// Entries of a vector of positions, rates or accelerations: 2 rows.
  std::size_t size() const { return size_; }

  /// A lane's next step, and what became of the last attempt.
  struct Step {
    double h_s = 0.0;      ///< 0 leaves the lane alone
    double error_m = 0.0;  ///< how far positions may be from the solution, as unresolved_m_s
    /// False when Newton's method did not converge: there is no new state then.
    bool converged = false;
    int iterations = 0;
    /// Speed [m/s] that the step hardly resolves: h times the two highest Legendre coefficients of
    /// the accelerations, mean square over the chain's mass.
    double unresolved_m_s = 0.0;
    bool is_accepted = true;
  };
  Step& step(std::size_t lane) { return steps_[lane]; }
  const Step& step(std::size_t lane) const { return steps_[lane]; }

  /// Puts a chain at rest into a lane.
  void load(std::size_t lane, const Chain& chain);
  /// Position, rates, and the mean acceleration over the step that led there.
  void set_state(std::size_t lane, const double* q_v_mean);
  /// Tries the step of each lane.
  void attempt();
  /// Takes the states at the end of the last attempt in the lanes whose step is_accepted.
  void accept();

  /// Entry i of position, rates and mean acceleration of a lane's state, and of the accelerations
  /// at the stages of its last attempt.
  using Entries = std::array<double, 3 + GaussCollocation::kStages>;
  Entries entries(std::size_t lane, std::size_t i) const;
  /// All of them, a vector after the other.
  std::vector<double> state_and_stages(std::size_t lane) const;

 private:
  LaneKernel kernel_;
  std::size_t size_;
  LaneChains chains_;
  LaneMemory memory_;
  CollocationArrays arrays_{};
  std::vector<double> total_kg_;
  std::vector<Step> steps_;
};

}  // namespace oblique::solver
