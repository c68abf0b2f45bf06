#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/validation/clamped_beam.h"
#include "tests/validation/validation_table.h"

namespace oblique::validation {
namespace {

constexpr double kLength_m = 0.4;
constexpr double kEI_N_m2 = 1570.0;

/// Tip of the inextensible cantilever under a force P across it, in closed form (Bisshopp and
/// Drucker, Quarterly of Applied Mathematics 3, 1945, 272): with p in (1/sqrt 2, 1),
/// sin phi_1 = 1/(p sqrt 2) and alpha = P L^2/EI,
///
///   sqrt(alpha) = K(p) - F(phi_1, p),   v/L = 1 - 2 (E(p) - E(phi_1, p))/sqrt(alpha),
///   (L - u)/L = sqrt(2 (2 p^2 - 1)/alpha).
struct Elastica {
  double v_over_L;  ///< across
  double u_over_L;  ///< back along the beam
};

Elastica elastica(double alpha) {
  const auto root_alpha = [](double p) {
    return std::comp_ellint_1(p) - std::ellint_1(p, std::asin(std::sqrt(0.5) / p));
  };
  double low = std::sqrt(0.5);
  double high = 1.0 - 1e-15;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (root_alpha(middle) < std::sqrt(alpha) ? low : high) = middle;
  }
  const double p = 0.5 * (low + high);
  const double arc = std::comp_ellint_2(p) - std::ellint_2(p, std::asin(std::sqrt(0.5) / p));
  return {1.0 - 2.0 * arc / std::sqrt(alpha), 1.0 - std::sqrt(2.0 * (2.0 * p * p - 1.0) / alpha)};
}

/// EA L^2/EI: so large that the beam's stretch stays below 1e-6.
constexpr double kSlenderness = 1e8;

ClampedBeam beam_of(int elements) {
  return ClampedBeam(
      {kLength_m, kSlenderness * kEI_N_m2 / (kLength_m * kLength_m), kEI_N_m2, elements});
}

/// Distance of the tip from where the elastica has it, over the length.
double elastica_error(double alpha, int elements) {
  ClampedBeam beam = beam_of(elements);
  beam.load_to({alpha * kEI_N_m2 / (kLength_m * kLength_m), 0.0}, 20);
  const Elastica right = elastica(alpha);
  const ClampedBeam::Tip tip = beam.tip();
  return std::hypot(tip.y_m / kLength_m - right.v_over_L,
                    1.0 - tip.x_m / kLength_m - right.u_over_L);
}

/// Distance of the tip from the clamp, over the length, under the moment that makes a full circle.
double roll_up_error(int elements) {
  ClampedBeam beam = beam_of(elements);
  beam.load_to({0.0, 2.0 * M_PI * kEI_N_m2 / kLength_m}, 40);
  return std::hypot(beam.tip().x_m, beam.tip().y_m) / kLength_m;
}

TEST(Elastica, ClosedFormHasThePublishedValues) {
  struct Published {
    double alpha, v_over_L, u_over_L;
  };
  for (const Published& p :
       {Published{1.0, 0.3017, 0.0564}, {5.0, 0.7138, 0.3876}, {10.0, 0.8106, 0.5550}}) {
    EXPECT_NEAR(elastica(p.alpha).v_over_L, p.v_over_L, 5e-5);
    EXPECT_NEAR(elastica(p.alpha).u_over_L, p.u_over_L, 5e-5);
  }
}

TEST(Elastica, CantileverBendsAsTheElasticaUnderAForceAcross) {
  const std::string reference = "elliptic integrals (Bisshopp and Drucker 1945)";
  for (const double alpha : {1.0, 5.0, 10.0}) {
    const std::string load = "cantilever, FL^2/EI = " + std::to_string(std::lround(alpha));
    const double coarse = elastica_error(alpha, 32);
    const double fine = elastica_error(alpha, 64);
    expect_at_most({load + ", n = 64: tip, of L", reference, fine, 5e-5,
                    "half the last digit of the published tables"});
    expect_at_least({load + ": error at n = 32, of that at 64", reference, coarse / fine, 8.0,
                     "order 4 sets in once an element no longer locks"});
  }
}

TEST(Elastica, CantileverRollsUpToACircleUnderAMoment) {
  const std::string reference = "full circle";
  const double coarse = roll_up_error(32);
  const double fine = roll_up_error(64);
  expect_at_most({"roll-up at M = 2 pi EI/L, n = 64: gap, of L", reference, fine, 1e-6,
                  "stretch of the bent beam, 2 (2 pi)^2 EI/(EA L^2) = 7.9e-7"});
  expect_at_least({"roll-up: gap at n = 32, of that at 64", reference, coarse / fine, 8.0,
                   "order 4 sets in once an element no longer locks"});
}

}  // namespace
}  // namespace oblique::validation
