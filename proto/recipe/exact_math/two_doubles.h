#pragma once

#include <cmath>

namespace oblique::exact_math {

/// A value of about 106 digits, high + low: |low| is at most half a unit of the last digit of
/// `high`. Only +, -, *, / and the fused multiply-add are used, which every machine rounds alike,
/// so results are the same bits everywhere. Relative error of one operation: below 2^-100. Nothing
/// is promised of values so large or small that a product of halves leaves the range of a double.
struct TwoDoubles {
  double high = 0.0;
  double low = 0.0;

  /// Rounded once.
  double rounded() const { return high + low; }
};

/// The exact sum of two doubles (Knuth 1969).
inline TwoDoubles exact_sum(double a, double b) {
  const double sum = a + b;
  const double b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

/// The same where |a| >= |b| or a is 0 (Dekker 1971).
inline TwoDoubles exact_sum_of_ordered(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

/// The exact product of two doubles.
inline TwoDoubles exact_product(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

inline TwoDoubles operator-(const TwoDoubles& a) {
  return {-a.high, -a.low};
}

inline TwoDoubles operator+(const TwoDoubles& a, const TwoDoubles& b) {
  const TwoDoubles highs = exact_sum(a.high, b.high);
  const TwoDoubles lows = exact_sum(a.low, b.low);
  const TwoDoubles upper = exact_sum_of_ordered(highs.high, highs.low + lows.high);
  return exact_sum_of_ordered(upper.high, upper.low + lows.low);
}

inline TwoDoubles operator-(const TwoDoubles& a, const TwoDoubles& b) {
  return a + -b;
}

inline TwoDoubles operator*(const TwoDoubles& a, const TwoDoubles& b) {
  const TwoDoubles highs = exact_product(a.high, b.high);
  const double cross = std::fma(a.high, b.low, a.low * b.high);
  return exact_sum_of_ordered(highs.high, highs.low + cross);
}

inline TwoDoubles operator*(const TwoDoubles& a, double b) {
  const TwoDoubles high = exact_product(a.high, b);
  return exact_sum_of_ordered(high.high, std::fma(a.low, b, high.low));
}

inline TwoDoubles operator/(const TwoDoubles& a, const TwoDoubles& b) {
  const double first = a.high / b.high;
  const TwoDoubles rest = a - b * first;
  const double second = rest.high / b.high;
  const TwoDoubles rest_of_rest = rest - b * second;
  const TwoDoubles sum = exact_sum_of_ordered(first, second);
  return exact_sum_of_ordered(sum.high, sum.low + rest_of_rest.high / b.high);
}

/// The square root of a value above 0, or 0 of 0.
inline TwoDoubles square_root(const TwoDoubles& a) {
  if (!(a.high > 0.0)) {
    return {};
  }
  const double root = std::sqrt(a.high);
  const TwoDoubles rest = a - exact_product(root, root);
  return exact_sum_of_ordered(root, rest.high / (2.0 * root));
}

/// a 2^exponent, which changes no digit.
inline TwoDoubles scaled(const TwoDoubles& a, int exponent) {
  return {std::ldexp(a.high, exponent), std::ldexp(a.low, exponent)};
}

/// The polynomial c[0] + c[1] x + ... + c[n] x^n.
template <typename Coefficients>
TwoDoubles polynomial(const Coefficients& c, std::size_t n, const TwoDoubles& x) {
  TwoDoubles sum = c[n];
  while (n-- > 0) {
    sum = sum * x + c[n];
  }
  return sum;
}

}  // namespace oblique::exact_math
