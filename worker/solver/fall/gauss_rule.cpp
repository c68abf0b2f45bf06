#include "worker/solver/fall/gauss_rule.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

namespace oblique::solver {
namespace {

constexpr auto kRows = static_cast<Eigen::Index>(GaussRule6::kStages);
using Square = Eigen::Matrix<double, kRows, kRows>;

/// Legendre polynomials of degrees 0 to 6 at x in [-1, 1].
struct LegendreValues {
  explicit LegendreValues(double x) : P{1.0, x} {
    for (std::size_t n = 2; n <= GaussRule6::kStages; ++n) {
      const auto k = static_cast<double>(n);
      P[n] = ((2.0 * k - 1.0) * x * P[n - 1] - (k - 1.0) * P[n - 2]) / k;
    }
  }
  double P[GaussRule6::kStages + 1];
};

}  // namespace

GaussRule6::GaussRule6() {
  constexpr auto n = static_cast<double>(kStages);
  for (std::size_t i = 0; i < kStages; ++i) {
    double x = -std::cos(std::numbers::pi * (static_cast<double>(i) + 0.75) / (n + 0.5));
    double slope = 0.0;
    for (int newton = 0; newton < 20; ++newton) {
      const LegendreValues at(x);
      slope = n * (x * at.P[kStages] - at.P[kStages - 1]) / (x * x - 1.0);
      x -= at.P[kStages] / slope;
    }
    node[i] = 0.5 * (1.0 + x);
    weight[i] = 1.0 / ((1.0 - x * x) * slope * slope);
    position_weight[i] = weight[i] * (1.0 - node[i]);
    const LegendreValues at(x);
    for (std::size_t degree = 0; degree < kStages; ++degree) {
      legendre[degree][i] = (2.0 * static_cast<double>(degree) + 1.0) * weight[i] * at.P[degree];
    }
    highest[0][i] = legendre[kStages - 1][i];
    highest[1][i] = legendre[kStages - 2][i];
  }
  Square A;
  for (std::size_t i = 0; i < kStages; ++i) {
    integrals(node[i], integral[i]);
    for (std::size_t j = 0; j < kStages; ++j) {
      A(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = integral[i][j];
    }
  }
  const Eigen::EigenSolver<Square> eigen(A);
  const auto T = eigen.eigenvectors().eval();
  const auto inverse = T.inverse().eval();
  std::size_t pair = 0;
  for (Eigen::Index k = 0; k < kRows; ++k) {
    const std::complex<double> lambda = eigen.eigenvalues()[k];
    if (lambda.imag() < 0.0) {
      continue;  // the other one of a pair
    }
    const std::complex<double> squared = lambda * lambda;
    squared_re[pair] = squared.real();
    squared_im[pair] = squared.imag();
    for (std::size_t i = 0; i < kStages; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      into_re[pair][i] = inverse(k, row).real();
      into_im[pair][i] = inverse(k, row).imag();
      const std::complex<double> back = 2.0 * T(row, k);
      back_re[i][pair] = back.real();
      back_im[i][pair] = -back.imag();
      shift_re[i][pair] = (back * squared).real();
      shift_im[i][pair] = -(back * squared).imag();
    }
    ++pair;
  }
}

void GaussRule6::integrals(double c, double* b) const {
  const LegendreValues at(2.0 * c - 1.0);
  // int_0^c P_k(2 t - 1) dt
  double of_legendre[kStages];
  of_legendre[0] = c;
  for (std::size_t k = 1; k < kStages; ++k) {
    of_legendre[k] = 0.5 * (at.P[k + 1] - at.P[k - 1]) / (2.0 * static_cast<double>(k) + 1.0);
  }
  for (std::size_t j = 0; j < kStages; ++j) {
    b[j] = 0.0;
    for (std::size_t k = kStages; k-- > 0;) {
      b[j] += legendre[k][j] * of_legendre[k];
    }
  }
}

}  // namespace oblique::solver
