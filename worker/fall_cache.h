#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>

#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::worker {

/// Keeps the fingers that were used last, each with its fall, so that one fall serves all points of
/// a model over all batches. May be used from several threads.
class FallCache {
 public:
  /// Keeps at most `capacity` fingers, at least one.
  explicit FallCache(std::size_t capacity);

  /// The finger of `model`, made when it is not kept. It stays valid while the pointer is held,
  /// kept or not. Throws solver::InputError when the model is outside its domain.
  std::shared_ptr<const solver::Finger> finger(const solver::ModelParameters& model);

 private:
  const std::size_t capacity_;
  std::mutex mutex_;
  std::list<std::shared_ptr<const solver::Finger>> fingers_;  // the one used last comes first
};

}  // namespace oblique::worker
