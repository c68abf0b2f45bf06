#pragma once

#include <cstddef>

#include "worker/batch.h"
#include "worker/batch_solver.h"
#include "worker/fall_cache.h"

namespace oblique::worker {

/// Solves points of batches. May be used from several threads.
class PointSolver {
 public:
  /// Keeps the falls of `models_kept` models.
  explicit PointSolver(std::size_t models_kept);

  /// Solves the points that `next` gives, side by side, and hands each result to `take`. A point
  /// that has no answer, and one with a value that is not finite, becomes a failed point with the
  /// reason; nothing is thrown for it.
  void solve(const Batch& batch, const BatchSolver::NextPoint& next,
             const BatchSolver::TakeResult& take);

 private:
  FallCache fingers_;
};

}  // namespace oblique::worker
