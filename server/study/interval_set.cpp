#include "server/study/interval_set.h"

#include <algorithm>
#include <iterator>

namespace oblique::server {

void IntervalSet::insert(std::uint64_t begin, std::uint64_t end) {
  if (begin >= end) {
    return;
  }
  auto next = ends_.upper_bound(begin);
  if (next != ends_.begin() && std::prev(next)->second >= begin) {
    --next;
    begin = next->first;
  }
  while (next != ends_.end() && next->first <= end) {
    end = std::max(end, next->second);
    size_ -= next->second - next->first;
    next = ends_.erase(next);
  }
  ends_.emplace_hint(next, begin, end);
  size_ += end - begin;
}

void IntervalSet::erase(std::uint64_t begin, std::uint64_t end) {
  if (begin >= end) {
    return;
  }
  auto next = ends_.upper_bound(begin);
  if (next != ends_.begin() && std::prev(next)->second > begin) {
    --next;
  }
  while (next != ends_.end() && next->first < end) {
    const Interval old{next->first, next->second};
    size_ -= old.end - old.begin;
    next = ends_.erase(next);
    if (old.begin < begin) {
      ends_.emplace(old.begin, begin);
      size_ += begin - old.begin;
    }
    if (old.end > end) {
      ends_.emplace(end, old.end);
      size_ += old.end - end;
    }
  }
}

bool IntervalSet::contains(std::uint64_t point) const {
  const auto next = ends_.upper_bound(point);
  return next != ends_.begin() && std::prev(next)->second > point;
}

std::optional<Interval> IntervalSet::first_from(std::uint64_t point) const {
  auto next = ends_.upper_bound(point);
  if (next != ends_.begin() && std::prev(next)->second > point) {
    return Interval{point, std::prev(next)->second};
  }
  return next == ends_.end() ? std::nullopt : std::optional(Interval{next->first, next->second});
}

std::vector<Interval> IntervalSet::within(std::uint64_t begin, std::uint64_t end) const {
  std::vector<Interval> parts;
  auto next = ends_.upper_bound(begin);
  if (next != ends_.begin() && std::prev(next)->second > begin) {
    --next;
  }
  for (; next != ends_.end() && next->first < end; ++next) {
    parts.push_back({std::max(begin, next->first), std::min(end, next->second)});
  }
  return parts;
}

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
