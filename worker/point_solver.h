#pragma once

#include <cstddef>

#include "worker/batch.h"
#include "worker/batch_solver.h"
#include "worker/solver/fall_cache.h"
#include "worker/solver/solve.h"

namespace oblique::worker {

/// Solves points of batches. May be used from several threads.
class PointSolver {
 public:
  /// Keeps falls in at most so much memory.
  explicit PointSolver(std::size_t fall_bytes) : falls_({.bytes = fall_bytes}) {}
  explicit PointSolver(const solver::FallCache::Bounds& bounds,
                       const solver::FallCache::Solve& solve)
      : falls_(bounds, solve) {}

  /// Solves the points that `next` gives, each of its own model, side by side, and hands each
  /// result to `take`. A fall that a point misses is solved beside those that later points of the
  /// batch miss. A point that has no answer, one whose fall has none, and one with a value that is
  /// not finite, becomes a failed point with the reason; nothing is thrown for it. Results have
  /// estimated errors where the study wants them.
  void solve(const Batch& batch, const BatchSolver::NextPoint& next,
             const BatchSolver::TakeResult& take);

  /// Solves the point of an order and gives its instants to `sink`: the same bits as in a batch.
  /// The result's number is 0. Nothing is thrown for a point without an answer, nor for an order
  /// that makes no sense: it fails.
  protocol::PointResult trace(const protocol::TraceOrder& order, const solver::Tracing::Sink& sink);

 private:
  solver::FallCache falls_;
};

}  // namespace oblique::worker
