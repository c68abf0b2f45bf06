#include "worker/fall_cache.h"

#include <algorithm>

namespace oblique::worker {

FallCache::FallCache(std::size_t capacity) : capacity_(std::max<std::size_t>(capacity, 1)) {}

std::shared_ptr<const solver::Finger> FallCache::finger(const solver::ModelParameters& model) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(fingers_.begin(), fingers_.end(),
                                  [&](const auto& kept) { return kept->model() == model; });
  if (found != fingers_.end()) {
    fingers_.splice(fingers_.begin(), fingers_, found);
    return fingers_.front();
  }
  // Making a finger is cheap: its fall is solved at the first point, outside this lock.
  fingers_.push_front(std::make_shared<const solver::Finger>(model));
  if (fingers_.size() > capacity_) {
    fingers_.pop_back();
  }
  return fingers_.front();
}

}  // namespace oblique::worker
