#pragma once

#include <vector>

namespace oblique::server {

/// Numbers from `low` to `high`; each end is in, but for an open one.
struct ValueRange {
  double low;
  double high;
  bool low_is_open = false;
  bool high_is_open = false;

  bool contains(double value) const {
    return (low_is_open ? value > low : value >= low) &&
           (high_is_open ? value < high : value <= high);
  }
};

/// A union of intervals.
class ValueSet {
 public:
  static ValueSet all();
  ValueSet() = default;  ///< of no number
  explicit ValueSet(ValueRange interval) : intervals_{interval} {}

  const std::vector<ValueRange>& intervals() const { return intervals_; }
  bool contains(double value) const;

  void unite(const ValueSet& other);
  /// Work by the product of the numbers of intervals.
  void intersect(const ValueSet& other);

 private:
  std::vector<ValueRange> intervals_;  ///< may overlap
};

}  // namespace oblique::server
