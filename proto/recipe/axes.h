#pragma once

#include <cstdint>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::protocol {

/// Number of values of an axis.
std::uint64_t axis_size(const Axis& axis);

/// Value i of an axis. A range has its two ends exactly; the values between are equally spaced, and
/// the same bits on every machine. Throws std::out_of_range for a value that the axis does not
/// have.
double axis_value(const Axis& axis, std::uint64_t i);

/// Smallest and largest value of an axis that has any.
double smallest_value(const Axis& axis);
double largest_value(const Axis& axis);

/// Numbers of the values of a range that tell whether all of them are allowed. Every key allows an
/// interval, for which the two ends are enough, or the whole numbers of one: when the first two
/// values are whole their distance is, and so are all.
std::vector<std::uint64_t> deciding_values(const Axis& axis);

}  // namespace oblique::protocol
