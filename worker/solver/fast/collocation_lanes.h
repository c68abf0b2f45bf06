#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/fast/lane_chains.h"
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

  /// Puts a chain at rest into a lane.
  void load(std::size_t lane, const Chain& chain);
  /// Position, rates, and the mean acceleration over the step that led there.
  void set_state(std::size_t lane, const double* q, const double* v, const double* mean);

  struct Attempt {
    /// False when Newton's method did not converge: there is no new state then.
    bool converged = false;
    int iterations = 0;
    /// Speed [m/s] that the step hardly resolves: h times the two highest Legendre coefficients of
    /// the accelerations, mean square over the chain's mass.
    double unresolved_m_s = 0.0;
  };
  /// Tries a step of h_s[lane] seconds in each lane; 0 leaves a lane alone. `error_m` is how far
  /// positions may be from the solution, mean square over the chain's mass.
  void attempt(std::span<const double> h_s, std::span<const double> error_m,
               std::span<Attempt> attempts);
  /// Makes the states at the end of the last attempt the lanes' own where accept[lane] != 0; the
  /// others stay.
  void settle(std::span<const unsigned char> accept);

  /// Copies out position, rates and mean acceleration of a lane's state.
  void copy_state(std::size_t lane, double* q_v_mean) const;
  /// Copies out the accelerations at the stages of the last attempt.
  void copy_stages(std::size_t lane, double* accelerations) const;
  /// Entry i of a lane's position or rates, and of a stage's acceleration in the last attempt.
  double q(std::size_t lane, std::size_t i) const { return arrays_.state[i * lanes() + lane]; }
  double v(std::size_t lane, std::size_t i) const {
    return arrays_.state[(size_ + i) * lanes() + lane];
  }
  double stage_a(std::size_t lane, std::size_t stage, std::size_t i) const {
    return arrays_.stage_a[(stage * size_ + i) * lanes() + lane];
  }

 private:
  LaneKernel kernel_;
  std::size_t size_;
  LaneChains chains_;
  LaneMemory memory_;
  CollocationArrays arrays_{};
  std::vector<double> total_kg_;
};

}  // namespace oblique::solver
