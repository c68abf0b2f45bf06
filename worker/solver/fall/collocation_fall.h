#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "worker/solver/chain/chain.h"
#include "worker/solver/fall/collocation_kernels.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/motion/fall.h"

namespace oblique::solver {

/// Tightest accuracy that falls are solved to by collocation. Its errors fall slowly with the step,
/// as vibrations that it does not resolve do; beyond this, explicit steps are quicker (README.md).
inline constexpr double kTightestCollocation = 3e-6;

/// A chain whose fall is wanted. What is pointed to must outlive the fall, `progress` only its
/// solution.
struct FallRequest {
  const Chain* chain;
  const ModelParameters* model;      ///< of the chain
  double accuracy;                   ///< relative, of what a contact after the fall gives
  FallProgress* progress = nullptr;  ///< told how far the fall is, where there is one
};

/// Solves falls of chains of one shape by Gauss collocation, side by side in lanes, and gives them
/// in the order asked for. A fall has the same bits whatever was solved beside it. Throws
/// std::invalid_argument where shapes differ.
std::vector<FallSolution> solve_by_collocation(
    std::span<const FallRequest> requests,
    const CollocationKernel& kernel = runnable_collocation_kernels().front());

}  // namespace oblique::solver
