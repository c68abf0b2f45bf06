#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::solver {

/// A point of one of several models.
struct ModelPoint {
  std::size_t model;  ///< number of its model, from 0
  Point point;
};

struct ManyOptions {
  std::size_t threads = 0;  ///< 0: one for each core
  bool errors = false;      ///< estimate errors too, which takes about a quarter more time
  /// Called by the calling thread about every 50 ms with the number of outcomes so far. The work
  /// ends when it returns false or throws. May be empty.
  std::function<bool(std::size_t outcomes)> goes_on = {};
  std::shared_ptr<FallCache> falls = {};  ///< empty: falls are kept for this call only
};

/// Solves points on several threads and in all vector lanes. Passes each outcome to `take`, one at
/// a time, on threads of its own and in any order; the outcome's number is the index in `points`,
/// which may be in any order. Returns true when all outcomes were passed on, false when `goes_on`
/// returned false; after that `take` is not called. A point without an answer, or with a wrong
/// model or value, gets an outcome with the reason. Throws InputError for a model number that does
/// not exist, and what `take` or `goes_on` throw. May be called by several threads at once.
bool solve_many(std::span<const ModelParameters> models, std::span<const ModelPoint> points,
                const TakeOutcome& take, const ManyOptions& options = {});

}  // namespace oblique::solver
