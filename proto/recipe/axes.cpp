#include "proto/recipe/axes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace oblique::protocol {

bool has_own_values(const Axis& axis) {
  return axis.count() > 0 || axis.values_size() > 0;
}

std::uint64_t axis_size(const Axis& axis) {
  if (axis.count() > 0) {
    return axis.count();
  }
  const bool is_single = axis.has_distribution() || !axis.expression().empty();
  return is_single ? 1 : static_cast<std::uint64_t>(axis.values_size());
}

RangeValues::RangeValues(const Axis& axis)
    : from_(axis.from()),
      to_(axis.to()),
      last_(axis.count() - 1),
      is_logarithmic_(axis.spacing() == SPACING_LOGARITHMIC) {
  constexpr double kExactBelow = 0x1p53;
  constexpr double kLargestExactPower = 1e22;
  const auto last = static_cast<double>(last_);
  for (double per_unit = 1.0; !is_logarithmic_ && last_ > 0 && per_unit <= kLargestExactPower;
       per_unit *= 10.0) {
    const double first = std::round(from_ * per_unit);
    const double end = std::round(to_ * per_unit);
    if (!(std::abs(first) < kExactBelow && std::abs(end) < kExactBelow && last < kExactBelow)) {
      break;
    }
    if (first / per_unit == from_ && end / per_unit == to_ && std::fmod(end - first, last) == 0.0) {
      decimals_ = {first, (end - first) / last, per_unit};
      break;
    }
  }
}

double RangeValues::at(std::uint64_t i) const {
  if (i == 0 || i == last_) {
    return i == 0 ? from_ : to_;
  }
  if (decimals_) {
    return (decimals_->first + decimals_->step * static_cast<double>(i)) / decimals_->per_unit;
  }
  const auto part = static_cast<long double>(i);
  const auto last = static_cast<long double>(last_);
  const auto from = static_cast<long double>(from_);
  const auto to = static_cast<long double>(to_);
  const long double value = is_logarithmic_ ? from * std::pow(to / from, part / last)
                                            : (from * (last - part) + to * part) / last;
  return std::min(std::max(static_cast<double>(value), from_), to_);
}

double axis_value(const Axis& axis, std::uint64_t i) {
  if (!has_own_values(axis) || i >= axis_size(axis)) {
    throw std::out_of_range("axis " + axis.key() + " has no value " + std::to_string(i));
  }
  return axis.count() == 0 ? axis.values(static_cast<int>(i)) : RangeValues(axis).at(i);
}

std::uint64_t first_value_from(const Axis& axis, double value) {
  std::uint64_t first = 0;
  std::uint64_t end = axis_size(axis);
  while (first < end) {
    const std::uint64_t middle = first + (end - first) / 2;
    if (axis_value(axis, middle) < value) {
      first = middle + 1;
    } else {
      end = middle;
    }
  }
  return first;
}

double smallest_value(const Axis& axis) {
  if (axis.has_distribution()) {
    const Distribution& drawn = axis.distribution();
    return drawn.has_from() ? drawn.from() : -std::numeric_limits<double>::infinity();
  }
  return axis.count() > 0 ? axis.from()
                          : *std::min_element(axis.values().begin(), axis.values().end());
}

double largest_value(const Axis& axis) {
  if (axis.has_distribution()) {
    const Distribution& drawn = axis.distribution();
    return drawn.has_to() ? drawn.to() : std::numeric_limits<double>::infinity();
  }
  return axis.count() > 0 ? axis.to()
                          : *std::max_element(axis.values().begin(), axis.values().end());
}

}  // namespace oblique::protocol
