#include "server/asking/value_set.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>
#include <utility>

namespace oblique::server {
namespace {

bool begins_before(const ValueRange& a, const ValueRange& b) {
  return a.low < b.low || (a.low == b.low && !a.low_is_open && b.low_is_open);
}

bool ends_before(const ValueRange& a, const ValueRange& b) {
  return a.high < b.high || (a.high == b.high && a.high_is_open && !b.high_is_open);
}

/// Whether no number lies between `a` and `b`, which begins behind it.
bool meets(const ValueRange& a, const ValueRange& b) {
  return b.low < a.high || (b.low == a.high && !(a.high_is_open && b.low_is_open));
}

}  // namespace

ValueSet ValueSet::all() {
  return ValueSet(
      {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()});
}

ValueSet::ValueSet(ValueRange range) {
  if (!range.is_empty()) {
    ranges_.push_back(range);
  }
}

bool ValueSet::contains(double value) const {
  const auto behind =
      std::upper_bound(ranges_.begin(), ranges_.end(), value,
                       [](double v, const ValueRange& range) { return v < range.low; });
  return std::any_of(behind - std::min<std::ptrdiff_t>(behind - ranges_.begin(), 2), behind,
                     [value](const ValueRange& range) { return range.contains(value); });
}

void ValueSet::unite(const ValueSet& other) {
  std::vector<ValueRange> both;
  std::merge(ranges_.begin(), ranges_.end(), other.ranges_.begin(), other.ranges_.end(),
             std::back_inserter(both), begins_before);
  ranges_.clear();
  for (const ValueRange& range : both) {
    if (ranges_.empty() || !meets(ranges_.back(), range)) {
      ranges_.push_back(range);
    } else if (ends_before(ranges_.back(), range)) {
      ranges_.back().high = range.high;
      ranges_.back().high_is_open = range.high_is_open;
    }
  }
}

void ValueSet::intersect(const ValueSet& other) {
  std::vector<ValueRange> common;
  auto a = ranges_.begin();
  auto b = other.ranges_.begin();
  while (a != ranges_.end() && b != other.ranges_.end()) {
    const ValueRange& lower = begins_before(*a, *b) ? *b : *a;
    const ValueRange& upper = ends_before(*a, *b) ? *a : *b;
    const ValueRange both{lower.low, upper.high, lower.low_is_open, upper.high_is_open};
    if (!both.is_empty()) {
      common.push_back(both);
    }
    if (ends_before(*a, *b)) {
      ++a;
    } else {
      ++b;
    }
  }
  ranges_ = std::move(common);
}

}  // namespace oblique::server
