#pragma once

#include "proto/recipe/exact_math/two_doubles.h"

namespace oblique::exact_math {

/// value 2^exponent, for results that leave the range of a double on their way.
struct Scaled {
  TwoDoubles value;
  int exponent = 0;

  /// Rounded once, also where the result is below the normal doubles.
  double rounded() const;
};

/// e^x for |x| <= 800, and e^x - 1 for |x| <= 0.34, to about 2^-95 of the result.
Scaled exp(const TwoDoubles& x);
TwoDoubles exp_minus_1(const TwoDoubles& x);
/// The natural logarithm of a finite x > 0, to about 2^-100 of the result.
TwoDoubles log(double x);

/// As in <cmath>, but computed in twice the precision and rounded once: the same bits on every
/// machine, and the double next to the exact result in all but one of 10^10 cases. NaN for
/// arguments outside the function's domain; infinite where the result is too large.
double exp_of(double x);
double log_of(double x);
double log2_of(double x);
double log10_of(double x);
double pow_of(double x, double y);
double sinh_of(double x);
double cosh_of(double x);
double tanh_of(double x);

}  // namespace oblique::exact_math
