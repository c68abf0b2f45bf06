#include "proto/recipe/sampling/normal.h"

#include <array>
#include <cmath>

#include "proto/recipe/exact_math/exponentials.h"

namespace oblique::sampling {
namespace {

/// Coefficients from the constant one on.
using Polynomial = std::array<double, 8>;

struct Ratio {
  Polynomial above;
  Polynomial below;
};

// Around the mean, in 0.180625 - q^2; in the tails, in r - 1.6; and far out, in r - 5.
constexpr Ratio kCentral{{3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
                          1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
                          3.3430575583588128105e4, 2.5090809287301226727e3},
                         {1.0, 4.2313330701600911252e1, 6.8718700749205790830e2,
                          5.3941960214247511077e3, 2.1213794301586595867e4, 3.9307895800092710610e4,
                          2.8729085735721942674e4, 5.2264952788528545610e3}};
constexpr Ratio kTail{
    {1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0,
     3.64784832476320460504e0, 1.27045825245236838258e0, 2.41780725177450611770e-1,
     2.27238449892691845833e-2, 7.74545014278341407640e-4},
    {1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1,
     1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4,
     1.05075007164441684324e-9}};
constexpr Ratio kFar{
    {6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0,
     2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
     2.71155556874348757815e-5, 2.01033439929228813265e-7},
    {1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
     7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7,
     2.04426310338993978564e-15}};

double value_at(const Polynomial& coefficients, double x) {
  double sum = 0.0;
  for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c) {
    sum = sum * x + *c;
  }
  return sum;
}

double value_at(const Ratio& ratio, double x) {
  return value_at(ratio.above, x) / value_at(ratio.below, x);
}

/// exp(-z^2/2) / sqrt(2 pi)
double density(double z) {
  constexpr double kInverseRootTwoPi = 0.39894228040143267794;
  constexpr double kNothingBeyond = 38.5;
  if (!(std::abs(z) < kNothingBeyond)) {
    return 0.0;
  }
  const auto exponent = exact_math::scaled(exact_math::exact_product(z, -z), -1);
  return kInverseRootTwoPi * exact_math::exp(exponent).rounded();
}

/// Part above z >= 2: density / (z + 1/(z + 2/(z + 3/...))), a continued fraction of Laplace.
double tail_above(double z) {
  constexpr int kLevels = 160;  // at z = 2 one more changes nothing
  double fraction = z;
  for (int level = kLevels; level > 0; --level) {
    fraction = z + level / fraction;
  }
  return density(z) / fraction;
}

/// density (z + z^3/3 + z^5/(3 5) + ...): the part between 0 and z, for |z| <= 2.
double part_from_mean(double z) {
  double term = z;
  double sum = 0.0;
  for (int next = 3; sum + term != sum; next += 2) {
    sum += term;
    term *= z * z / next;
  }
  return density(z) * sum;
}

}  // namespace

double normal_quantile(double p) {
  constexpr double kCentralHalf = 0.425;
  constexpr double kFarFrom = 5.0;
  const double q = p - 0.5;
  if (std::abs(q) <= kCentralHalf) {
    return q * value_at(kCentral, kCentralHalf * kCentralHalf - q * q);
  }
  const double r = std::sqrt(-exact_math::log_of(q < 0.0 ? p : 1.0 - p));
  const double z = r <= kFarFrom ? value_at(kTail, r - 1.6) : value_at(kFar, r - kFarFrom);
  return q < 0.0 ? -z : z;
}

double normal_part_below(double z) {
  constexpr double kTailFrom = 2.0;
  if (z <= -kTailFrom) {
    return tail_above(-z);
  }
  return z < kTailFrom ? 0.5 + part_from_mean(z) : 1.0 - tail_above(z);
}

}  // namespace oblique::sampling
