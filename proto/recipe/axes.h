#pragma once

#include <cstdint>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/exact_math/two_doubles.h"

namespace oblique::protocol {

/// Number of values of an axis: as many as a list or a range has, and 1 of an axis whose values are
/// drawn from a distribution or follow from others.
std::uint64_t axis_size(const Axis& axis);

/// Whether the values stand in the axis itself, as a list or a range.
bool has_own_values(const Axis& axis);

/// Value i of a list or a range. A range has its two ends exactly; the values between are equally
/// spaced, or their logarithms are, and the same bits on every machine. Throws std::out_of_range
/// for a value that the axis does not have.
double axis_value(const Axis& axis, std::uint64_t i);

/// The values of one range for many looks: what they have in common is computed once.
class RangeValues {
 public:
  /// Of an axis with a count.
  explicit RangeValues(const Axis& axis);
  double at(std::uint64_t i) const;

 private:
  double from_;
  double to_;
  std::uint64_t last_;
  bool is_logarithmic_;
  exact_math::TwoDoubles log_from_{};
  exact_math::TwoDoubles log_ratio_{};
};

/// Number of the first value of a rising axis, which every range is, that is at least `value`, and
/// the axis' size when there is none: its inverse.
std::uint64_t first_value_from(const Axis& axis, double value);

/// Bounds of the values of a list, a range or a distribution; of the last they may be infinite.
double smallest_value(const Axis& axis);
double largest_value(const Axis& axis);

/// Numbers of the values of a range that tell whether all of them are allowed. Every key allows an
/// interval, for which the two ends are enough, or the whole numbers of one: when the first two
/// values are whole their distance is, and so are all.
std::vector<std::uint64_t> deciding_values(const Axis& axis);

}  // namespace oblique::protocol
