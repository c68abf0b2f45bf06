#include "worker/solver/reference/beam_element.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>
#include <type_traits>

namespace oblique::solver {
namespace {

constexpr double kLength_m = 0.1;
constexpr double kEA_N = 3.7e7;
constexpr double kEI_N_m2 = 1570.0;

const ElementConstants<double>& constants() {
  static const auto of_element = element_constants(kLength_m, kEA_N, kEI_N_m2, 1.4);
  return of_element;
}

/// Rows: position and slope of node i, then of node j. Columns: the two directions.
using Nodes = Eigen::Matrix<double, 4, 2>;

Nodes random_nodes(std::mt19937_64& generator) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Nodes q;
  for (int i = 0; i < q.size(); ++i) {
    q.data()[i] = uniform(generator);
  }
  q.row(0) *= kLength_m;
  q.row(2) *= kLength_m;
  return q;
}

Nodes straight_nodes(double angle_rad, double x_m, double y_m) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  Nodes q;
  q << x_m, y_m, c, s, x_m + kLength_m * c, y_m + kLength_m * s, c, s;
  return q;
}

double energy(const Nodes& q) {
  return strain_energy(q.transpose(), constants());
}

Nodes energy_gradient(const Nodes& q) {
  return elastic_gradient(q.transpose(), constants()).transpose();
}

/// Returns the derivative at 0 from five points. It is exact up to degree 4, the degree of the
/// energy.
template <class Function>
std::invoke_result_t<Function, double> five_point_difference(const Function& f, double h) {
  return ((f(-2.0 * h) - f(2.0 * h)) + 8.0 * (f(h) - f(-h))) / (12.0 * h);
}

/// Returns the Hermite shape functions at x, or their derivatives of order 1 or 2.
Eigen::RowVector4d shape(int order, double x) {
  const double l = kLength_m;
  const double z = x / l;
  Eigen::RowVector4d s;
  switch (order) {
    case 0:
      s << 1 - 3 * z * z + 2 * z * z * z, l * (z - 2 * z * z + z * z * z),
          3 * z * z - 2 * z * z * z, l * (z * z * z - z * z);
      return s;
    case 1:
      s << (-6 * z + 6 * z * z) / l, 1 - 4 * z + 3 * z * z, (6 * z - 6 * z * z) / l,
          3 * z * z - 2 * z;
      return s;
    default:
      s << (-6 + 12 * z) / (l * l), (-4 + 6 * z) / l, (6 - 12 * z) / (l * l), (6 * z - 2) / l;
      return s;
  }
}

/// Returns the nodal values p_i, s_i, p_j, s_j of the function x^power.
Eigen::Vector4d monomial(int power) {
  const auto x_to = [](double x, int n) { return n < 0 ? 0.0 : std::pow(x, n); };
  return {x_to(0.0, power), power * x_to(0.0, power - 1), x_to(kLength_m, power),
          power * x_to(kLength_m, power - 1)};
}

/// Integrates the product of the derivatives of x^a and x^b over the element.
double monomial_integral(int a, int b, int derivatives) {
  double factor = 1.0;
  for (int i = 0; i < derivatives; ++i) {
    factor *= (a - i) * (b - i);
  }
  const int power = a + b - 2 * derivatives;
  return factor == 0.0 ? 0.0 : factor * std::pow(kLength_m, power + 1) / (power + 1);
}

void expect_exact_on_cubics(const Eigen::Matrix4d& matrix, double factor, int derivatives) {
  for (int a = 0; a <= 3; ++a) {
    for (int b = 0; b <= 3; ++b) {
      const double exact = factor * monomial_integral(a, b, derivatives);
      const double scale = factor * std::pow(kLength_m, a + b - 2 * derivatives + 1);
      EXPECT_NEAR(monomial(a).dot(matrix * monomial(b)), exact, 1e-13 * scale)
          << "x^" << a << " and x^" << b;
    }
  }
}

TEST(BeamElement, ElasticForceIsMinusTheGradientOfTheStrainEnergy) {
  std::mt19937_64 generator(1);
  for (int sample = 0; sample < 200; ++sample) {
    const Nodes q = random_nodes(generator);
    const Nodes direction = random_nodes(generator);
    const double expected =
        five_point_difference([&](double h) -> double { return energy(q + h * direction); }, 0.1);
    const double scale = energy_gradient(q).norm() * direction.norm();
    EXPECT_NEAR(energy_gradient(q).cwiseProduct(direction).sum(), expected, 1e-12 * scale);
  }
}

TEST(BeamElement, RigidMotionsGiveNeitherForceNorEnergy) {
  for (const double angle_rad : {0.0, 0.3, 1.5707, 2.6, -3.0}) {
    const Nodes q = straight_nodes(angle_rad, 0.7, -1.2);
    // Strains are differences of numbers of size 1. So rounding gives forces of EA times epsilon,
    // and energies of EA l times epsilon squared.
    EXPECT_LT(energy_gradient(q).cwiseAbs().maxCoeff(), 1e-14 * kEA_N) << angle_rad;
    EXPECT_LT(energy(q), 1e-26 * kEA_N * kLength_m) << angle_rad;
  }
}

TEST(BeamElement, UniformStretchStoresTheEnergyOfTheGreenStrain) {
  Nodes q = straight_nodes(0.4, 0.0, 0.0);
  q *= 1.1;
  const double strain = 0.5 * (1.1 * 1.1 - 1.0);
  EXPECT_NEAR(energy(q), 0.5 * kEA_N * kLength_m * strain * strain, 1e-12 * energy(q));
}

TEST(BeamElement, FiveGaussPointsGiveTheExactEnergy) {
  std::mt19937_64 generator(3);
  constexpr int kIntervals = 4000;
  for (int sample = 0; sample < 10; ++sample) {
    const Nodes q = random_nodes(generator);
    double simpson = 0.0;
    for (int i = 0; i <= kIntervals; ++i) {
      const double x = kLength_m * i / kIntervals;
      const double strain = 0.5 * ((shape(1, x) * q).squaredNorm() - 1.0);
      const double curvature_squared = (shape(2, x) * q).squaredNorm();
      const double weight = i == 0 || i == kIntervals ? 1.0 : (i % 2 == 0 ? 2.0 : 4.0);
      simpson += weight * 0.5 * (kEA_N * strain * strain + kEI_N_m2 * curvature_squared);
    }
    simpson *= kLength_m / kIntervals / 3.0;
    // The error of Simpson's rule is the fourth power of the interval, 1e-14, times a fourth
    // derivative.
    EXPECT_NEAR(energy(q), simpson, 1e-10 * energy(q));
  }
}

TEST(BeamElement, MassMatrixIsExactOnPolynomials) {
  expect_exact_on_cubics(mass_matrix(1.4, kLength_m), 1.4, 0);
}

TEST(BeamElement, GradientMatrixIsExactOnPolynomials) {
  expect_exact_on_cubics(gradient_matrix(kLength_m), 1.0, 1);
}

TEST(BeamElement, BendingMatrixIsExactOnPolynomials) {
  expect_exact_on_cubics(bending_matrix(kLength_m), 1.0, 2);
}

TEST(BeamElement, UniformLoadIsExactOnPolynomials) {
  const auto load = uniform_load(kLength_m);
  for (int a = 0; a <= 3; ++a) {
    EXPECT_NEAR(monomial(a).dot(load), monomial_integral(a, 0, 0), 1e-15);
  }
}

TEST(BeamElement, ConstantsAgreeWithTheMassMatrix) {
  const Eigen::Matrix4d m = mass_matrix(1.4, kLength_m);
  const auto& k = constants();
  const Eigen::Matrix4d expected{{k.m_pp, k.m_ps, k.n_pp, -k.n_ps},
                                 {k.m_ps, k.m_ss, k.n_ps, -k.n_ss},
                                 {k.n_pp, k.n_ps, k.m_pp, -k.m_ps},
                                 {-k.n_ps, -k.n_ss, -k.m_ps, k.m_ss}};
  EXPECT_LT((m - expected).cwiseAbs().maxCoeff(), 1e-15 * m.norm());
}

TEST(BeamElement, TangentIsTheDerivativeOfTheElasticForceAndSymmetric) {
  std::mt19937_64 generator(5);
  for (int sample = 0; sample < 50; ++sample) {
    const Nodes q = random_nodes(generator);
    const ElementTangent tangent = elastic_tangent(q.transpose(), constants());
    const double scale = tangent.cwiseAbs().maxCoeff();
    EXPECT_LT((tangent - tangent.transpose()).cwiseAbs().maxCoeff(), 1e-14 * scale);
    for (int column = 0; column < 8; ++column) {
      Nodes direction = Nodes::Zero();
      direction(column / 2, column % 2) = 1.0;
      // The force is a cubic polynomial, for which a difference of five points is exact.
      const Nodes derivative = five_point_difference(
          [&](double h) -> Nodes { return energy_gradient(q + h * direction); }, 0.01);
      const Eigen::Vector<double, 8> expected = derivative.transpose().reshaped();
      EXPECT_LT((tangent.col(column) - expected).cwiseAbs().maxCoeff(), 1e-11 * scale);
    }
  }
}

TEST(BeamElement, AMatrixForOneDirectionActsEquallyOnBoth) {
  const Eigen::Matrix4d matrix = Eigen::Matrix4d::Random();
  const ElementCoordinates q = ElementCoordinates::Random();
  const ElementCoordinates expected = q * matrix.transpose();
  const Eigen::Vector<double, 8> product = in_both_directions(matrix) * q.reshaped();
  EXPECT_LT((product - expected.reshaped()).norm(), 1e-15);
}

}  // namespace
}  // namespace oblique::solver
