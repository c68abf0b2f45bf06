#include "server/scheduler/attempt_runs.h"

#include <iterator>

namespace oblique::server {

void AttemptRuns::set(const Interval& range, std::uint32_t attempts) {
  if (range.begin >= range.end) {
    return;
  }
  make_room(range);
  Interval merged = range;
  const auto next = runs_.find(range.end);
  if (next != runs_.end() && next->second.attempts == attempts) {
    merged.end = next->second.end;
    runs_.erase(next);
  }
  auto place = runs_.lower_bound(range.begin);
  if (place != runs_.begin()) {
    const auto before = std::prev(place);
    if (before->second.end == range.begin && before->second.attempts == attempts) {
      before->second.end = merged.end;
      return;
    }
  }
  runs_.emplace_hint(place, merged.begin, Run{merged.end, attempts});
}

/// Cuts `range` out of the runs that are there.
void AttemptRuns::make_room(const Interval& range) {
  auto next = runs_.upper_bound(range.begin);
  if (next != runs_.begin() && std::prev(next)->second.end > range.begin) {
    --next;
  }
  while (next != runs_.end() && next->first < range.end) {
    const std::uint64_t begin = next->first;
    const Run old = next->second;
    next = runs_.erase(next);
    if (begin < range.begin) {
      runs_.emplace_hint(next, begin, Run{range.begin, old.attempts});
    }
    if (old.end > range.end) {
      runs_.emplace_hint(next, range.end, old);
    }
  }
}

}  // namespace oblique::server
