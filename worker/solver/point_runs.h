#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"
#include "worker/solver/solve_many.h"

namespace oblique::solver {

/// Points of many models, for one thread.
class PointSource {
 public:
  /// Points that follow each other and share a model.
  struct Run {
    std::size_t model;                  ///< its number
    std::optional<std::uint64_t> next;  ///< the first point after them; none: they are the last
  };

  virtual ~PointSource() = default;

  /// The number of the next point to solve; nothing at the end.
  virtual std::optional<std::uint64_t> next() = 0;
  /// That point. Throws an exception with the reason if the point cannot be solved.
  virtual ModelPoint point(std::uint64_t number) = 0;
  /// The run that a point is in, whether or not the point can be solved.
  virtual Run run_of(std::uint64_t number) = 0;
  virtual ModelParameters model(std::size_t model_number) = 0;
};

/// Solves the points of `source` side by side and passes each outcome to `sink`. A missing fall is
/// solved together with those that later points need. A result with a value that is not finite
/// becomes an error. Throws only what `sink` throws.
void solve_points_of_models(PointSource& source, FallCache& falls, bool with_errors,
                            const TakeOutcome& sink);

/// Number of points that a thread takes at a time when `left` points are left: about 10 ms of quick
/// points, so that threads seldom wait for the lock, and fewer near the end, so that they finish
/// together.
std::uint64_t points_of_task(std::uint64_t left, std::size_t threads);

}  // namespace oblique::solver
