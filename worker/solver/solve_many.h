#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::solver {

/// A point of one of many models.
struct ModelPoint {
  std::size_t model;  ///< its number
  Point point;
};

/// How many points are solved.
struct ManyOptions {
  std::size_t threads = 0;  ///< 0: one a core that this process may use
  bool errors = false;      ///< estimate errors too, at about a quarter more time
  /// Called by the calling thread every 50 ms or so, with the number of outcomes so far. False, and
  /// anything that it throws, ends the work; may be empty.
  std::function<bool(std::size_t outcomes)> goes_on = {};
  std::shared_ptr<FallCache> falls = {};  ///< empty: falls of this call alone
};

/// Solves points side by side, on many threads and in all lanes of their vector registers, and
/// gives each outcome to `take`, one at a time, by threads of its own and in any order; its number
/// is the point's place in `points`. Points may be in any order: those that share a fall, a drop or
/// a contact's beginning are brought together. Returns true when all were given, and false when
/// `goes_on` was false; then, and when `take` or `goes_on` throws, points under way may be
/// abandoned, and nothing is given after the return. Nothing is thrown for a point without an
/// answer, nor for a model or a value outside its range: its outcome says why. Throws InputError
/// for a point whose model is not there, and what `take` or `goes_on` throw. May be called by
/// several threads at once.
bool solve_many(std::span<const ModelParameters> models, std::span<const ModelPoint> points,
                const TakeOutcome& take, const ManyOptions& options = {});

}  // namespace oblique::solver
