#pragma once

#include <memory>
#include <span>
#include <vector>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/motion.h"

namespace oblique::solver {

/// Smallest tolerance at which collocation can be faster than explicit steps (collocation.md).
inline constexpr double kTightestCollocation = 3e-6;

/// A fall to solve. The chain must outlive it. `progress` is used only during the solution.
struct FallRequest {
  const Chain* chain;
  std::shared_ptr<const Motion> motion;  ///< motion of the chain by the explicit integrator
  double dt_s;                           ///< explicit step
  double accuracy;                       ///< allowed relative error of outputs of the contact
  FallProgress* progress = nullptr;
};

/// Solves falls of chains of one shape by explicit steps, side by side in lanes. Solutions are in
/// the order of the requests. A fall has the same bits alone and beside others.
std::vector<FallSolution> solve_by_steps(
    std::span<const FallRequest> requests,
    const LaneKernel& kernel = runnable_lane_kernels().front());

/// Like solve_by_steps(), but by Gauss collocation.
std::vector<FallSolution> solve_by_collocation(
    std::span<const FallRequest> requests,
    const LaneKernel& kernel = runnable_lane_kernels().front());

}  // namespace oblique::solver
