#include "server/scheduler/points/loss_history.h"

#include <algorithm>

namespace oblique::server {
namespace {

/// More losses than this say nothing new, unless the process held nothing else.
constexpr std::size_t kMostNoted = 16;

}  // namespace

void LossHistory::add(const Loss& loss) {
  const auto known = std::find_if(losses_.begin(), losses_.end(), [&](const Loss& other) {
    return other.process != kNobody && other.process == loss.process;
  });
  if (known != losses_.end()) {
    known->alone = known->alone || loss.alone;
  } else if (loss.alone || losses_.size() < kMostNoted) {
    losses_.push_back(loss);
  }
}

bool LossHistory::take_back(ProcessNumber process) {
  return std::erase_if(losses_, [&](const Loss& loss) {
           return process != kNobody && loss.process == process;
         }) > 0;
}

std::size_t LossHistory::alone() const {
  return static_cast<std::size_t>(
      std::count_if(losses_.begin(), losses_.end(), [](const Loss& loss) { return loss.alone; }));
}

Standing LossHistory::standing(const LossLimits& limits) const {
  const std::size_t so_alone = alone();
  if (so_alone >= limits.condemned_after) {
    return Standing::kCondemned;
  }
  if (so_alone > 0) {
    return Standing::kAccused;
  }
  return count() >= limits.suspect_after ? Standing::kSuspect : Standing::kSound;
}

}  // namespace oblique::server
