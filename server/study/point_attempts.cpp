#include "server/study/point_attempts.h"

#include <iterator>

namespace oblique::server {

void PointAttempts::set(const Interval& range, std::uint32_t attempts) {
  if (range.begin >= range.end) {
    return;
  }
  make_room(range);
  Interval merged = range;
  const auto next = counts_.find(range.end);
  if (next != counts_.end() && next->second.attempts == attempts) {
    merged.end = next->second.end;
    counts_.erase(next);
  }
  auto place = counts_.lower_bound(range.begin);
  if (place != counts_.begin()) {
    const auto before = std::prev(place);
    if (before->second.end == range.begin && before->second.attempts == attempts) {
      before->second.end = merged.end;
      return;
    }
  }
  counts_.emplace_hint(place, merged.begin, Counted{merged.end, attempts});
}

/// Removes `range` from the stored intervals.
void PointAttempts::make_room(const Interval& range) {
  auto next = counts_.upper_bound(range.begin);
  if (next != counts_.begin() && std::prev(next)->second.end > range.begin) {
    --next;
  }
  while (next != counts_.end() && next->first < range.end) {
    const std::uint64_t begin = next->first;
    const Counted old = next->second;
    next = counts_.erase(next);
    if (begin < range.begin) {
      counts_.emplace_hint(next, begin, Counted{range.begin, old.attempts});
    }
    if (old.end > range.end) {
      counts_.emplace_hint(next, range.end, old);
    }
  }
}

}  // namespace oblique::server
