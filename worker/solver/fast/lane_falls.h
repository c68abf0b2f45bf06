#pragma once

#include <memory>
#include <span>
#include <vector>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/motion.h"

namespace oblique::solver {

/// Tightest accuracy that falls are solved to by collocation; beyond it, explicit steps are quicker
/// (collocation.md).
inline constexpr double kTightestCollocation = 3e-6;

/// A chain whose fall is requested. The chain must outlive the fall; `progress` is used only while
/// it is solved.
struct FallRequest {
  const Chain* chain;
  std::shared_ptr<const Motion> motion;  ///< explicit, of that chain
  double dt_s;                           ///< of explicit steps
  double accuracy;                       ///< relative, of what a contact after the fall gives
  FallProgress* progress = nullptr;
};

/// Solves falls of chains of one shape by explicit steps, side by side in lanes, in the given
/// order. A fall has the same bits whatever was solved beside it.
std::vector<FallSolution> solve_by_steps(
    std::span<const FallRequest> requests,
    const LaneKernel& kernel = runnable_lane_kernels().front());

/// The same by Gauss collocation.
std::vector<FallSolution> solve_by_collocation(
    std::span<const FallRequest> requests,
    const LaneKernel& kernel = runnable_lane_kernels().front());

}  // namespace oblique::solver
