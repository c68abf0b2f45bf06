#include "proto/recipe/exact_math/trigonometry.h"

#include <cmath>
#include <limits>
#include <utility>

#include "proto/recipe/exact_math/constants.h"

namespace oblique::exact_math {
namespace {

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
constexpr TwoDoubles kOne{1.0, 0.0};
/// x^3 is nothing beside x.
constexpr double kNearZero = 1e-20;

/// x = quarter pi / 2 + rest, |rest| <= pi / 4.
struct Reduced {
  unsigned quarter;  ///< modulo 4
  TwoDoubles rest;
};

Reduced reduced(double x) {
  const double k = std::floor(x / kHalfPi.high + 0.5);
  // Three doubles of pi / 2: what is left near a zero has all its digits still.
  TwoDoubles rest = TwoDoubles{x, 0.0} - exact_product(kHalfPi.high, k);
  rest = rest - exact_product(kHalfPi.low, k);
  rest = rest - exact_product(kHalfPiRest, k);
  const double quarter = k - 4.0 * std::floor(k / 4.0);
  return {static_cast<unsigned>(quarter), rest};
}

/// x^first / first! - x^(first + 2) / (first + 2)! + ..., without the factor x^first.
TwoDoubles alternating(std::size_t first, const TwoDoubles& square) {
  constexpr std::size_t kLast = 30;
  std::size_t n = kLast - (kLast - first) % 2;
  TwoDoubles sum = kInverseFactorials[n];
  while (n > first) {
    n -= 2;
    sum = kInverseFactorials[n] - sum * square;
  }
  return sum;
}

/// Sine and cosine of |x| <= pi / 4.
std::pair<TwoDoubles, TwoDoubles> sine_and_cosine(const TwoDoubles& x) {
  const TwoDoubles square = x * x;
  return {x * alternating(1, square), alternating(0, square)};
}

/// Sine and cosine of any x.
std::pair<TwoDoubles, TwoDoubles> turned(const Reduced& angle) {
  const auto [sine, cosine] = sine_and_cosine(angle.rest);
  switch (angle.quarter) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

bool is_angle(double x) {
  constexpr double kLargestAngle = 1e9;
  return std::abs(x) <= kLargestAngle;
}

/// Of x >= 0.
TwoDoubles arc_tangent(const TwoDoubles& x) {
  if (x.high > 1.0) {
    return kHalfPi - arc_tangent(kOne / x);
  }
  // atan x = 2 atan(x / (1 + sqrt(1 + x^2))), three times; then |t| < 0.099.
  constexpr int kHalvings = 3;
  constexpr std::size_t kTerms = 16;
  TwoDoubles t = x;
  for (int i = 0; i < kHalvings; ++i) {
    t = t / (kOne + square_root(kOne + t * t));
  }
  return scaled(t * polynomial(kInverseOdds, kTerms, -(t * t)), kHalvings);
}

}  // namespace

double sin_of(double x) {
  if (std::abs(x) < kNearZero) {
    return x;
  }
  return is_angle(x) ? turned(reduced(x)).first.rounded() : kNotANumber;
}

double cos_of(double x) {
  return is_angle(x) ? turned(reduced(x)).second.rounded() : kNotANumber;
}

double tan_of(double x) {
  if (std::abs(x) < kNearZero) {
    return x;
  }
  if (!is_angle(x)) {
    return kNotANumber;
  }
  const auto [sine, cosine] = turned(reduced(x));
  return (sine / cosine).rounded();
}

double atan_of(double x) {
  if (std::isnan(x) || std::abs(x) < kNearZero) {
    return x;
  }
  const double size = std::abs(x);
  constexpr double kFlat = 1e300;  // the inverse would leave the normal doubles
  const double angle = size > kFlat ? kHalfPi.high : arc_tangent({size, 0.0}).rounded();
  return std::copysign(angle, x);
}

double asin_of(double x) {
  const double size = std::abs(x);
  if (!(size <= 1.0)) {
    return kNotANumber;
  }
  if (size < kNearZero) {
    return x;
  }
  if (size == 1.0) {
    return std::copysign(kHalfPi.high, x);
  }
  const TwoDoubles adjacent = square_root(exact_sum(1.0, -size) * exact_sum(1.0, size));
  return std::copysign(arc_tangent(TwoDoubles{size, 0.0} / adjacent).rounded(), x);
}

double acos_of(double x) {
  if (!(std::abs(x) <= 1.0)) {
    return kNotANumber;
  }
  if (x == -1.0) {
    return kPi.high;
  }
  return scaled(arc_tangent(square_root(exact_sum(1.0, -x) / exact_sum(1.0, x))), 1).rounded();
}

}  // namespace oblique::exact_math
