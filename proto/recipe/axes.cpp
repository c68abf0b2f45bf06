#include "proto/recipe/axes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "proto/recipe/exact_math/exponentials.h"

namespace oblique::protocol {
namespace {

using exact_math::TwoDoubles;

/// (from (last − i) + to i) / last, rounded once: then 0.1:1.0:10 holds what a person types as 0.3,
/// and the value is the same bits on every machine.
double interpolated(double from, double to, std::uint64_t i, std::uint64_t last) {
  const TwoDoubles a = exact_math::exact_product(from, static_cast<double>(last - i));
  const TwoDoubles b = exact_math::exact_product(to, static_cast<double>(i));
  const TwoDoubles sum = exact_math::exact_sum(a.high, b.high);
  const double low = sum.low + (a.low + b.low);
  const double divisor = static_cast<double>(last);
  const double quotient = (sum.high + low) / divisor;
  const double remainder = std::fma(-quotient, divisor, sum.high) + low;
  return quotient + remainder / divisor;
}

}  // namespace

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
  if (is_logarithmic_) {
    log_from_ = exact_math::log(from_);
    log_ratio_ = exact_math::log(to_) - log_from_;
  }
}

double RangeValues::at(std::uint64_t i) const {
  if (i == 0) {
    return from_;
  }
  if (i == last_) {
    return to_;
  }
  double value = 0.0;
  if (is_logarithmic_) {
    const TwoDoubles part = log_ratio_ * static_cast<double>(i);
    const TwoDoubles last{static_cast<double>(last_), 0.0};
    value = exact_math::exp(log_from_ + part / last).rounded();
  } else {
    // Products with the count must not overflow; scaling by a power of two changes no digit.
    constexpr int kScaleExponent = 64;
    const bool huge = std::max(std::abs(from_), std::abs(to_)) > 1e280;
    const int exponent = huge ? kScaleExponent : 0;
    value = std::ldexp(
        interpolated(std::ldexp(from_, -exponent), std::ldexp(to_, -exponent), i, last_), exponent);
  }
  return std::min(std::max(value, from_), to_);
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

std::vector<std::uint64_t> deciding_values(const Axis& axis) {
  std::vector<std::uint64_t> deciding{0};
  for (const std::uint64_t i : {std::uint64_t{1}, axis.count() - 1}) {
    if (i < axis.count() && i > deciding.back()) {
      deciding.push_back(i);
    }
  }
  return deciding;
}

}  // namespace oblique::protocol
