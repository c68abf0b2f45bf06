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

}  // namespace oblique::server
