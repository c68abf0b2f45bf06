#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/validation/validation_table.h"
#include "worker/solver/reference/banded.h"
#include "worker/solver/reference/beam_element.h"

namespace oblique::validation {
namespace {

constexpr std::size_t kBandwidth = 7;
constexpr std::size_t kClamped = 4;  ///< number of coordinates of the clamped node
constexpr double kConverged = 1e-12;
constexpr int kMaxIterations = 50;

/// A cantilever of the solver's elements in static equilibrium. Newton's method with the solver's
/// tangent finds this state. The cantilever is clamped at the origin; without load it is straight
/// along x.
class ClampedBeam {
 public:
  struct Properties {
    double length_m;
    double EA_N;
    double EI_N_m2;
    int elements;
  };
  struct TipLoad {
    double force_y_N;   ///< force whose direction is constant
    double moment_N_m;  ///< counter-clockwise
  };
  struct Tip {
    double x_m;
    double y_m;
    double angle_rad;  ///< angle between tangent and x axis, in (-pi, pi]
  };

  explicit ClampedBeam(const Properties& properties);

  /// Applies `load` in `increments` equal steps, each solved by Newton's method. Throws
  /// std::runtime_error unless the largest correction falls below 1e-12 within 50 iterations.
  /// Corrections of positions are in units of an element's length.
  void load_to(const TipLoad& load, int increments);
  Tip tip() const;

 private:
  void equilibrate(const TipLoad& load);
  double newton_step(const TipLoad& load);

  Properties properties_;
  double element_length_m_;
  TipLoad load_{0.0, 0.0};
  std::vector<double> q_;  ///< per node: x and y of the position, x and y of the slope
};

ClampedBeam::ClampedBeam(const Properties& properties)
    : properties_(properties),
      element_length_m_(properties.length_m / properties.elements),
      q_(4 * (static_cast<std::size_t>(properties.elements) + 1), 0.0) {
  for (std::size_t i = 0; i < q_.size(); i += 4) {
    q_[i] = element_length_m_ * static_cast<double>(i / 4);
    q_[i + 2] = 1.0;
  }
}

void ClampedBeam::load_to(const TipLoad& load, int increments) {
  const TipLoad from = load_;
  for (int i = 1; i <= increments; ++i) {
    const double part = static_cast<double>(i) / increments;
    equilibrate({from.force_y_N + part * (load.force_y_N - from.force_y_N),
                 from.moment_N_m + part * (load.moment_N_m - from.moment_N_m)});
  }
  load_ = load;
}

void ClampedBeam::equilibrate(const TipLoad& load) {
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (newton_step(load) < kConverged) {
      return;
    }
  }
  throw std::runtime_error("the clamped beam found no equilibrium");
}

double ClampedBeam::newton_step(const TipLoad& load) {
  solver::BandedLu<kBandwidth> matrix(q_.size() - kClamped);
  std::vector<double> residual(q_.size() - kClamped, 0.0);
  const auto constants =
      solver::element_constants(element_length_m_, properties_.EA_N, properties_.EI_N_m2, 0.0);
  for (std::size_t first = 0; first + 4 < q_.size(); first += 4) {
    const Eigen::Map<const solver::ElementCoordinates> q(&q_[first]);
    const solver::ElementCoordinates force = solver::elastic_gradient(q, constants);
    const auto tangent = solver::elastic_tangent(q, constants);
    for (std::size_t a = 0; a < 8; ++a) {
      if (first + a < kClamped) {
        continue;
      }
      residual[first + a - kClamped] += force.data()[a];
      for (std::size_t b = 0; b < 8; ++b) {
        if (first + b >= kClamped) {
          matrix.add(first + a - kClamped, first + b - kClamped,
                     tangent(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)));
        }
      }
    }
  }
  const std::size_t tip = residual.size() - 4;
  residual[tip + 1] -= load.force_y_N;
  // A moment does work on the angle of the slope: Q = M (-s_y, s_x)/|s|^2.
  const double x = q_[q_.size() - 2];
  const double y = q_[q_.size() - 1];
  const double s = x * x + y * y;
  const double m = load.moment_N_m / s;
  residual[tip + 2] += m * y;
  residual[tip + 3] -= m * x;
  matrix.add(tip + 2, tip + 2, -2.0 * m * x * y / s);
  matrix.add(tip + 2, tip + 3, m - 2.0 * m * y * y / s);
  matrix.add(tip + 3, tip + 2, -m + 2.0 * m * x * x / s);
  matrix.add(tip + 3, tip + 3, 2.0 * m * x * y / s);
  if (!matrix.factor()) {
    throw std::runtime_error("the tangent of the clamped beam is singular");
  }
  matrix.solve(residual.data());
  double largest = 0.0;
  for (std::size_t i = 0; i < residual.size(); ++i) {
    q_[i + kClamped] -= residual[i];
    const double scale = i % 4 < 2 ? element_length_m_ : 1.0;
    largest = std::max(largest, std::abs(residual[i]) / scale);
  }
  return largest;
}

ClampedBeam::Tip ClampedBeam::tip() const {
  const std::size_t i = q_.size() - 4;
  return {q_[i], q_[i + 1], std::atan2(q_[i + 3], q_[i + 2])};
}

constexpr double kLength_m = 0.4;
constexpr double kEI_N_m2 = 1570.0;

/// Tip of the inextensible cantilever under a force P across it, in closed form (Bisshopp and
/// Drucker, Quarterly of Applied Mathematics 3, 1945, 272): with p in (1/sqrt 2, 1),
/// sin phi_1 = 1/(p sqrt 2) and alpha = P L^2/EI,
///
///   sqrt(alpha) = K(p) - F(phi_1, p),   v/L = 1 - 2 (E(p) - E(phi_1, p))/sqrt(alpha),
///   (L - u)/L = sqrt(2 (2 p^2 - 1)/alpha).
struct Elastica {
  double v_over_L;  ///< deflection across the beam
  double u_over_L;  ///< deflection along the beam, towards the clamp
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

/// EA L^2/EI, so large that the strain of the beam stays below 1e-6.
constexpr double kSlenderness = 1e8;

ClampedBeam beam_of(int elements) {
  return ClampedBeam(
      {kLength_m, kSlenderness * kEI_N_m2 / (kLength_m * kLength_m), kEI_N_m2, elements});
}

/// Returns the distance between the computed tip and the tip of the elastica, divided by the
/// length.
double elastica_error(double alpha, int elements) {
  ClampedBeam beam = beam_of(elements);
  beam.load_to({alpha * kEI_N_m2 / (kLength_m * kLength_m), 0.0}, 20);
  const Elastica right = elastica(alpha);
  const ClampedBeam::Tip tip = beam.tip();
  return std::hypot(tip.y_m / kLength_m - right.v_over_L,
                    1.0 - tip.x_m / kLength_m - right.u_over_L);
}

/// Returns the distance between tip and clamp, divided by the length, under the moment that bends
/// the beam to a full circle.
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

TEST(Elastica, CantileverBendsAsTheElasticaUnderATransverseForce) {
  const std::string reference = "elliptic integrals (Bisshopp and Drucker 1945)";
  for (const double alpha : {1.0, 5.0, 10.0}) {
    const std::string load = "cantilever, FL^2/EI = " + std::to_string(std::lround(alpha));
    const double coarse = elastica_error(alpha, 32);
    const double fine = elastica_error(alpha, 64);
    expect_at_most({load + ", n = 64: tip, of L", reference, fine, 5e-5,
                    "half the last digit of the published tables"});
    expect_at_least({load + ": error at n = 32, of that at 64", reference, coarse / fine, 8.0,
                     "order 4 begins where elements no longer lock"});
  }
}

TEST(Elastica, CantileverRollsUpToACircleUnderAMoment) {
  const std::string reference = "full circle";
  const double coarse = roll_up_error(32);
  const double fine = roll_up_error(64);
  expect_at_most({"roll-up at M = 2 pi EI/L, n = 64: gap, of L", reference, fine, 1e-6,
                  "stretch of the bent beam, 2 (2 pi)^2 EI/(EA L^2) = 7.9e-7"});
  expect_at_least({"roll-up: gap at n = 32, of that at 64", reference, coarse / fine, 8.0,
                   "order 4 begins where elements no longer lock"});
}

}  // namespace
}  // namespace oblique::validation
