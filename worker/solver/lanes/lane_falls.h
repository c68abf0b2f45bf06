#pragma once

#include <memory>
#include <span>
#include <vector>

#include "worker/solver/chain/chain.h"
#include "worker/solver/lanes/lane_stepper.h"
#include "worker/solver/motion/fall.h"
#include "worker/solver/motion/fall_progress.h"
#include "worker/solver/motion/motion.h"

namespace oblique::solver {

/// A chain that is to fall by explicit steps of one length. What is pointed to must outlive the
/// fall, `progress` only its solution.
struct SteppedFall {
  const Chain* chain;
  std::shared_ptr<const Motion> motion;  ///< explicit, of that chain
  double dt_s;
  FallProgress* progress = nullptr;  ///< told how far the fall is, where there is one
};

/// Solves falls of chains of one shape by explicit steps, side by side in lanes, and gives them in
/// the order asked for. A fall has the same bits whatever was solved beside it.
std::vector<FallSolution> solve_by_steps(
    std::span<const SteppedFall> falls, const LaneKernel& kernel = runnable_lane_kernels().front());

}  // namespace oblique::solver
