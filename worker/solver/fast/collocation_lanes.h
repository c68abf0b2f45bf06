#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/reference/chain.h"

namespace oblique::solver {

/// Chains of one shape that fall side by side, one per lane, each with its own constants and step
/// length. The bits of a lane do not depend on other lanes.
class CollocationLanes {
 public:
  /// Makes lanes for chains of the shape of `chain`. Each lane contains `chain` at rest.
  CollocationLanes(const LaneKernel& kernel, const Chain& chain);

  std::size_t lanes() const { return memory_.lanes(); }

  /// The next step of a lane, and the outcome of its last attempt.
  struct Step {
    double h_s = 0.0;        ///< step length; a lane with 0 does not move
    double error_m = 0.0;    ///< allowed error of positions, mean square over the chain's mass
    bool converged = false;  ///< whether Newton's method converged
    int iterations = 0;
    /// Measure of unresolved motion [m/s]: h times the two highest Legendre coefficients of the
    /// accelerations, mean square over the chain's mass.
    double unresolved_m_s = 0.0;
    bool is_accepted = true;
  };
  Step& step(std::size_t lane) { return steps_[lane]; }
  const Step& step(std::size_t lane) const { return steps_[lane]; }

  /// Puts a chain at rest into a lane.
  void load(std::size_t lane, const Chain& chain);
  /// Vectors of positions, rates, and mean accelerations over the last step.
  std::vector<double> state(std::size_t lane) const;
  void set_state(std::size_t lane, const std::vector<double>& q_v_mean);
  /// Tries the step of each lane.
  void attempt();
  /// Accepts the last attempt in lanes whose step is_accepted; other lanes keep their states.
  void accept();

  /// One coordinate of a lane in the last attempt: the step length, the values at the start of the
  /// step and the accelerations at its stages.
  struct Coordinate {
    double h_s;
    double q;
    double v;
    std::array<double, GaussCollocation::kStages> a;
  };
  Coordinate coordinate(std::size_t lane, std::size_t i) const;
  /// Number of coordinates of a lane: 2 * rows.
  std::size_t coordinates() const { return vector_; }

 private:
  bool iterate(int iteration);

  LaneKernel kernel_;
  std::size_t vector_;  ///< length of each vector of positions, rates or accelerations
  LaneMemory memory_;
  CollocationArrays arrays_;
  std::vector<double> total_kg_;
  std::vector<double> correction_m_;  ///< size of each lane's last correction
  std::vector<Step> steps_;
};

}  // namespace oblique::solver
