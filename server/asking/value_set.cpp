#include "server/asking/value_set.h"

#include <algorithm>
#include <limits>

namespace oblique::server {

ValueSet ValueSet::all() {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return ValueSet({-kInfinity, kInfinity});
}

bool ValueSet::contains(double value) const {
  return std::any_of(intervals_.begin(), intervals_.end(),
                     [value](const ValueRange& interval) { return interval.contains(value); });
}

void ValueSet::unite(const ValueSet& other) {
  intervals_.insert(intervals_.end(), other.intervals_.begin(), other.intervals_.end());
}

void ValueSet::intersect(const ValueSet& other) {
  std::vector<ValueRange> common;
  for (const ValueRange& a : intervals_) {
    for (const ValueRange& b : other.intervals_) {
      const ValueRange& lower = a.low > b.low || (a.low == b.low && a.low_is_open) ? a : b;
      const ValueRange& upper = a.high < b.high || (a.high == b.high && a.high_is_open) ? a : b;
      const ValueRange both{lower.low, upper.high, lower.low_is_open, upper.high_is_open};
      const bool is_empty = both.low > both.high ||
                            (both.low == both.high && (both.low_is_open || both.high_is_open));
      if (!is_empty) {
        common.push_back(both);
      }
    }
  }
  intervals_ = std::move(common);
}

}  // namespace oblique::server
