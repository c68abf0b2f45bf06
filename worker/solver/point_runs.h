#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

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
  virtual ModelParameters model(std::uint64_t number) = 0;
  /// Models of the point that `next` gave last and of those behind it, in order, those of one fall
  /// that follow each other once: their falls are solved beside its own.
  virtual std::vector<ModelParameters> models_ahead() = 0;
};

/// Runs of points of one model that `models_ahead` should look at, and models that it should give,
/// at most.
inline constexpr int kRunsAhead = 4096;
inline constexpr std::size_t kFallsAhead = 64;

/// Adds a model to those ahead unless it shares the fall of the last one.
void add_ahead(std::vector<ModelParameters>& models, const ModelParameters& model);

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
