#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"
#include "worker/solver/solve_many.h"

namespace oblique::solver {

/// Gives points of many models to one thread.
class PointSource {
 public:
  /// Consecutive points of one model.
  struct Run {
    std::size_t model;                  ///< number of the model
    std::optional<std::uint64_t> next;  ///< first point of the next run; empty at the last run
  };

  virtual ~PointSource() = default;

  /// The number of the next point to solve; nothing at the end.
  virtual std::optional<std::uint64_t> next() = 0;
  /// Throws an exception with the reason if the point cannot be solved.
  virtual ModelPoint point(std::uint64_t number) = 0;
  /// The run that contains a point, even one that cannot be solved.
  virtual Run run_of(std::uint64_t number) = 0;
  virtual ModelParameters model(std::size_t model_number) = 0;
};

/// Solves the points of `source` side by side and passes each outcome to `sink`. Solves a missing
/// fall together with missing falls of later points. A result with a value that is not finite
/// becomes an error. Throws only exceptions of `sink`.
void solve_points_of_models(PointSource& source, FallCache& falls, bool with_errors,
                            const TakeOutcome& sink);

/// Returns the number of points that a thread takes at a time when `left` points are left. Near the
/// end the number is so small that all threads finish together. Earlier, quick points of that
/// number take about 10 ms, so that threads seldom wait.
std::uint64_t points_of_task(std::uint64_t left, std::size_t threads);

}  // namespace oblique::solver
