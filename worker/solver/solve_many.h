#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::solver {

struct ModelPoint {
  std::size_t model;  ///< index of its model
  Point point;
};

struct ManyOptions {
  std::size_t threads = 0;  ///< 0 means one for each core
  bool errors = false;      ///< also estimate errors; takes about a quarter more time
  /// Called about every 50 ms on the calling thread with the number of outcomes so far. The work
  /// ends when the function returns false or throws. May be empty.
  std::function<bool(std::size_t outcomes)> goes_on = {};
  std::shared_ptr<FallCache> falls = {};  ///< if null, falls are kept for this call only
};

/// Solves points on several threads and in all vector lanes. Passes each outcome to `take`, one at
/// a time, on other threads and in any order. The outcome's number is the index in `points`; its
/// error is the reason for a point without an answer, or with a wrong model or value. Returns true
/// after all outcomes, false if `goes_on` returned false; `take` is not called after that. Throws
/// InputError for a model number that does not exist, and exceptions of `take` and `goes_on`. May
/// be called by several threads at once.
bool solve_many(std::span<const ModelParameters> models, std::span<const ModelPoint> points,
                const TakeOutcome& take, const ManyOptions& options = {});

}  // namespace oblique::solver
