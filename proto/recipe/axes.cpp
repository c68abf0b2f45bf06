#include "proto/recipe/axes.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace oblique::protocol {
namespace {

/// value = a + b, as two doubles of which the second is below half a unit of the first's last
/// digit.
struct TwoDoubles {
  double high;
  double low;
};

/// Exact sum (Knuth 1969).
TwoDoubles exact_sum(double a, double b) {
  const double sum = a + b;
  const double b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

/// Exact product, by the fused multiply-add.
TwoDoubles exact_product(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

/// (from (last − i) + to i) / last, rounded once: then 0.1:1.0:10 holds what a person types as 0.3,
/// and the value is the same bits on every machine.
double interpolated(double from, double to, std::uint64_t i, std::uint64_t last) {
  const TwoDoubles a = exact_product(from, static_cast<double>(last - i));
  const TwoDoubles b = exact_product(to, static_cast<double>(i));
  const TwoDoubles sum = exact_sum(a.high, b.high);
  const double low = sum.low + (a.low + b.low);
  const double divisor = static_cast<double>(last);
  const double quotient = (sum.high + low) / divisor;
  const double remainder = std::fma(-quotient, divisor, sum.high) + low;
  return quotient + remainder / divisor;
}

}  // namespace

std::uint64_t axis_size(const Axis& axis) {
  return axis.count() > 0 ? axis.count() : static_cast<std::uint64_t>(axis.values_size());
}

double axis_value(const Axis& axis, std::uint64_t i) {
  if (i >= axis_size(axis)) {
    throw std::out_of_range("axis " + axis.key() + " has no value " + std::to_string(i));
  }
  if (axis.count() == 0) {
    return axis.values(static_cast<int>(i));
  }
  if (i == 0) {
    return axis.from();
  }
  if (i == axis.count() - 1) {
    return axis.to();
  }
  // Products with the count must not overflow; scaling by a power of two changes no digit.
  constexpr int kScaleExponent = 64;
  const bool huge = std::max(std::abs(axis.from()), std::abs(axis.to())) > 1e280;
  const int exponent = huge ? kScaleExponent : 0;
  const double value =
      std::ldexp(interpolated(std::ldexp(axis.from(), -exponent), std::ldexp(axis.to(), -exponent),
                              i, axis.count() - 1),
                 exponent);
  return std::min(std::max(value, axis.from()), axis.to());
}

double smallest_value(const Axis& axis) {
  return axis.count() > 0 ? axis.from()
                          : *std::min_element(axis.values().begin(), axis.values().end());
}

double largest_value(const Axis& axis) {
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
