#pragma once

#include <vector>

namespace oblique::server {

/// Numbers from `low` to `high`; each end is in, but for an open one.
struct ValueRange {
  double low;
  double high;
  bool low_is_open = false;
  bool high_is_open = false;

  bool is_empty() const { return !(low < high || (low == high && !low_is_open && !high_is_open)); }
  bool contains(double value) const {
    return (low_is_open ? value > low : value >= low) &&
           (high_is_open ? value < high : value <= high);
  }
};

/// A union of ranges.
class ValueSet {
 public:
  static ValueSet all();
  ValueSet() = default;  ///< of no number
  explicit ValueSet(ValueRange range);

  /// Rising and apart.
  const std::vector<ValueRange>& ranges() const { return ranges_; }
  bool contains(double value) const;

  /// Both in time by the number of ranges.
  void unite(const ValueSet& other);
  void intersect(const ValueSet& other);

 private:
  std::vector<ValueRange> ranges_;
};

}  // namespace oblique::server
