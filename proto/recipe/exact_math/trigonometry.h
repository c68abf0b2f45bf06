#pragma once

namespace oblique::exact_math {

/// As in <cmath>, but computed in twice the precision and rounded once: the same bits on every
/// machine. NaN for arguments outside the function's domain, and of sin, cos and tan for angles of
/// more than 10^9.
double sin_of(double x);
double cos_of(double x);
double tan_of(double x);
double asin_of(double x);
double acos_of(double x);
double atan_of(double x);

}  // namespace oblique::exact_math
