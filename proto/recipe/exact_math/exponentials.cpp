#include "proto/recipe/exact_math/exponentials.h"

#include <limits>

#include "proto/recipe/exact_math/constants.h"

namespace oblique::exact_math {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
/// e^x is 0 or infinite beyond.
constexpr double kLargestExponent = 750.0;
/// Beyond, e^-x is nothing beside e^x.
constexpr double kOneSided = 40.0;
/// x^3 is nothing beside x.
constexpr double kTiny = 1e-20;

bool is_odd(double whole) {
  return std::fmod(whole, 2.0) != 0.0;
}

double round_half_away(double x) {
  return x < 0.0 ? std::ceil(x - 0.5) : std::floor(x + 0.5);
}

/// x^n, x > 0, by squaring: exact where the result has at most 106 digits.
Scaled whole_power(double x, int n) {
  int exponent = 0;
  TwoDoubles square{std::frexp(x, &exponent), 0.0};
  TwoDoubles power{1.0, 0.0};
  for (int rest = std::abs(n); rest > 0; rest /= 2) {
    if (rest % 2 == 1) {
      power = power * square;
    }
    square = square * square;
  }
  return n < 0 ? Scaled{TwoDoubles{1.0, 0.0} / power, n * exponent} : Scaled{power, n * exponent};
}

/// Of x > 0, finite, and finite y.
double positive_power(double x, double y) {
  constexpr double kMultipliedOut = 64.0;
  if (y == std::floor(y) && std::abs(y) <= kMultipliedOut) {
    return whole_power(x, static_cast<int>(y)).rounded();
  }
  const TwoDoubles exponent = log(x) * y;
  if (!(std::abs(exponent.high) <= kLargestExponent)) {
    return exponent.high > 0.0 ? kInfinity : 0.0;
  }
  return exp(exponent).rounded();
}

}  // namespace

double Scaled::rounded() const {
  const double nearest = value.rounded();
  int digits_up_to = 0;
  std::frexp(nearest, &digits_up_to);
  constexpr int kLeastNormal = std::numeric_limits<double>::min_exponent;
  if (digits_up_to + exponent >= kLeastNormal || nearest == 0.0) {
    return std::ldexp(nearest, exponent);
  }
  // In units of the least double, so that the one rounding is to whole numbers.
  constexpr int kLeast = kLeastNormal - std::numeric_limits<double>::digits;
  const TwoDoubles units = scaled(value, exponent - kLeast);
  double whole = std::rint(units.high);
  const double rest = units.high - whole;
  if (std::abs(rest) == 0.5 && rest * units.low > 0.0) {
    whole += 2.0 * rest;
  }
  return std::ldexp(whole, kLeast);
}

TwoDoubles exp_minus_1(const TwoDoubles& x) {
  // The series of x / 2^k, and e^2t - 1 = (e^t - 1)^2 + 2 (e^t - 1).
  constexpr int kHalvings = 9;
  constexpr std::size_t kTerms = 9;
  const TwoDoubles t = scaled(x, -kHalvings);
  TwoDoubles sum = kInverseFactorials[kTerms];
  for (std::size_t n = kTerms - 1; n > 0; --n) {
    sum = sum * t + kInverseFactorials[n];
  }
  sum = sum * t;
  for (int i = 0; i < kHalvings; ++i) {
    sum = sum * sum + scaled(sum, 1);
  }
  return sum;
}

Scaled exp(const TwoDoubles& x) {
  const double k = round_half_away(x.high / kLn2.high);
  const TwoDoubles rest = x - kLn2 * k;
  return {TwoDoubles{1.0, 0.0} + exp_minus_1(rest), static_cast<int>(k)};
}

TwoDoubles log(double x) {
  constexpr double kRootHalf = 0.70710678118654752;
  int exponent = 0;
  double m = std::frexp(x, &exponent);
  if (m < kRootHalf) {
    m *= 2.0;
    --exponent;
  }
  // log m = 2 artanh s with s = (m - 1) / (m + 1), |s| < 0.172.
  const TwoDoubles s = TwoDoubles{m - 1.0, 0.0} / exact_sum(m, 1.0);
  constexpr std::size_t kTerms = 21;
  const TwoDoubles log_m = scaled(s * polynomial(kInverseOdds, kTerms, s * s), 1);
  return exponent == 0 ? log_m : kLn2 * static_cast<double>(exponent) + log_m;
}

double exp_of(double x) {
  if (std::isnan(x)) {
    return kNone;
  }
  if (std::abs(x) > kLargestExponent) {
    return x > 0.0 ? kInfinity : 0.0;
  }
  return exp({x, 0.0}).rounded();
}

namespace {

/// log x / divisor, or what stands for it where there is no logarithm.
template <typename Finish>
double logarithm(double x, Finish finish) {
  if (!(x > 0.0)) {
    return x == 0.0 ? -kInfinity : kNone;
  }
  return std::isinf(x) ? kInfinity : finish(log(x));
}

}  // namespace

double log_of(double x) {
  return logarithm(x, [](const TwoDoubles& log_x) { return log_x.rounded(); });
}

double log2_of(double x) {
  int exponent = 0;
  if (x > 0.0 && std::frexp(x, &exponent) == 0.5) {
    return exponent - 1;  // of a power of 2, exactly
  }
  return logarithm(x, [](const TwoDoubles& log_x) { return (log_x / kLn2).rounded(); });
}

double log10_of(double x) {
  return logarithm(x, [](const TwoDoubles& log_x) { return (log_x / kLn10).rounded(); });
}

double pow_of(double x, double y) {
  if (y == 0.0 || x == 1.0) {
    return 1.0;
  }
  if (!std::isfinite(x) || !std::isfinite(y)) {
    return kNone;
  }
  if (x == 0.0) {
    return y > 0.0 ? 0.0 : kInfinity;
  }
  if (x > 0.0) {
    return positive_power(x, y);
  }
  if (y != std::floor(y)) {
    return kNone;
  }
  const double power = positive_power(-x, y);
  return is_odd(y) ? -power : power;
}

double sinh_of(double x) {
  constexpr double kSmall = 0.34;
  const double size = std::abs(x);
  if (!(size <= kLargestExponent)) {
    return std::isnan(x) ? kNone : std::copysign(kInfinity, x);
  }
  if (size < kTiny) {
    return x;
  }
  double result = 0.0;
  if (size < kSmall) {
    const TwoDoubles e = exp_minus_1({size, 0.0});
    result = scaled(e + e / (TwoDoubles{1.0, 0.0} + e), -1).rounded();
  } else if (size > kOneSided) {
    Scaled e = exp({size, 0.0});
    --e.exponent;
    result = e.rounded();
  } else {
    const Scaled e = exp({size, 0.0});
    const TwoDoubles up = scaled(e.value, e.exponent);
    result = scaled(up - TwoDoubles{1.0, 0.0} / up, -1).rounded();
  }
  return std::copysign(result, x);
}

double cosh_of(double x) {
  const double size = std::abs(x);
  if (!(size <= kLargestExponent)) {
    return std::isnan(x) ? kNone : kInfinity;
  }
  Scaled e = exp({size, 0.0});
  if (size > kOneSided) {
    --e.exponent;
    return e.rounded();
  }
  const TwoDoubles up = scaled(e.value, e.exponent);
  return scaled(up + TwoDoubles{1.0, 0.0} / up, -1).rounded();
}

double tanh_of(double x) {
  constexpr double kSmall = 0.17;
  const double size = std::abs(x);
  if (!(size <= kOneSided)) {
    return std::isnan(x) ? kNone : std::copysign(1.0, x);
  }
  if (size < kTiny) {
    return x;
  }
  // tanh x = (e^2x - 1) / (e^2x + 1)
  TwoDoubles e;
  if (size < kSmall) {
    e = exp_minus_1({2.0 * size, 0.0});
  } else {
    const Scaled up = exp({2.0 * size, 0.0});
    e = scaled(up.value, up.exponent) - TwoDoubles{1.0, 0.0};
  }
  return std::copysign((e / (e + TwoDoubles{2.0, 0.0})).rounded(), x);
}

}  // namespace oblique::exact_math
