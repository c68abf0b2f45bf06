#pragma once

#include <cstdint>
#include <optional>

#include "proto/oblique.pb.h"

namespace oblique::protocol {

/// Number of values of an axis: the length of a list or range, and 1 for an axis with a
/// distribution or an expression.
std::uint64_t axis_size(const Axis& axis);

/// Whether the axis is a list or a range.
bool has_own_values(const Axis& axis);

/// Value i of a list or range. Throws std::out_of_range if the axis has no such value.
double axis_value(const Axis& axis, std::uint64_t i);

/// The values of a range. Both ends are exact. Value i of a linear range is (from (n - 1 - i) + to
/// i) / (n - 1). If ends and step are decimals, it is the double nearest to the decimal: 0.1:1:10
/// has 0.3. In a logarithmic range the logarithms are equally spaced.
class RangeValues {
 public:
  /// `axis` must have a count.
  explicit RangeValues(const Axis& axis);
  double at(std::uint64_t i) const;

 private:
  double from_;
  double to_;
  std::uint64_t last_;
  bool is_logarithmic_;
  /// Value i is (first + step i) / per_unit, in whole numbers below 2^53.
  struct Decimals {
    double first;
    double step;
    double per_unit;  ///< a power of ten
  };
  std::optional<Decimals> decimals_;
};

/// Index of the first value that is at least `value`, or the number of values. Values must rise.
std::uint64_t first_value_from(const Axis& axis, double value);

/// Bounds of the values of a list, range or distribution; those of a distribution may be infinite.
double smallest_value(const Axis& axis);
double largest_value(const Axis& axis);

}  // namespace oblique::protocol
