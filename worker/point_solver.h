#pragma once

#include <cstddef>
#include <cstdint>

#include "worker/fall_cache.h"
#include "worker/task.h"

namespace oblique::worker {

/// Solves single points of tasks. May be used from several threads.
class PointSolver {
 public:
  /// Keeps the falls of `models_kept` models.
  explicit PointSolver(std::size_t models_kept);

  /// What solving `point` gave. Never throws for a point that has no answer, and never holds a
  /// value that is not finite: both become a failed point with the reason.
  protocol::PointResult solve(const Task& task, std::uint64_t point);

 private:
  FallCache fingers_;
};

/// Whether every value of a result is a finite number.
bool is_finite(const protocol::PointResult& result);

}  // namespace oblique::worker
