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
  virtual ~PointSource() = default;

  /// The number of the next point; nothing when there is none, or when no more are wanted.
  virtual std::optional<std::uint64_t> next() = 0;
  /// That point. What it throws is the reason why the point has no answer.
  virtual ModelPoint point(std::uint64_t number) = 0;
  /// The number of its model, also where the point is not allowed.
  virtual std::size_t model_of(std::uint64_t number) = 0;
  virtual ModelParameters model(std::size_t model_number) = 0;
  /// The next point behind that one, given or not, that may be of another model; nothing when there
  /// is none.
  virtual std::optional<std::uint64_t> behind_model(std::uint64_t number) = 0;
};

/// Solves the points of `source`, each of its own model, side by side, and hands each outcome to
/// `sink`. A fall that a point misses is solved beside those that later points miss. A result with
/// a value that is not finite has failed. Nothing is thrown for a point that has no answer.
void solve_points_of_models(PointSource& source, FallCache& falls, bool with_errors,
                            const TakeOutcome& sink);

/// How many of the points that are left a thread should take at a time: as many as meet in a lock
/// seldom, about ten milliseconds of quick ones, and ever fewer towards the end, so that the
/// threads finish together.
std::uint64_t points_of_task(std::uint64_t left, std::size_t threads);

}  // namespace oblique::solver
