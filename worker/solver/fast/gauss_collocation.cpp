#include "worker/solver/fast/gauss_collocation.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <numbers>

namespace oblique::solver {
namespace {

/// Legendre polynomials up to the degree kStages at x in [-1, 1].
struct LegendreValues {
  explicit LegendreValues(double x) : P{1.0, x} {
    for (std::size_t n = 2; n <= GaussCollocation::kStages; ++n) {
      const auto k = static_cast<double>(n);
      P[n] = ((2.0 * k - 1.0) * x * P[n - 1] - (k - 1.0) * P[n - 2]) / k;
    }
  }
  double P[GaussCollocation::kStages + 1];
};

}  // namespace

GaussCollocation::GaussCollocation() {
  const auto n = static_cast<double>(kStages);
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
  }
  for (std::size_t i = 0; i < kStages; ++i) {
    integrals(node[i], integral[i]);
  }
  constexpr auto kRows = static_cast<Eigen::Index>(kStages);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::MatrixXd A = Eigen::Map<const RowMajor>(integral[0], kRows, kRows);
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen(A);
  const Eigen::MatrixXcd T = eigen.eigenvectors();
  const Eigen::MatrixXcd inverse = T.inverse();
  std::size_t pair = 0;
  for (Eigen::Index k = 0; k < kRows; ++k) {
    const std::complex<double> lambda = eigen.eigenvalues()[k];
    if (lambda.imag() < 0.0) {
      continue;  // the conjugate eigenvalue is kept instead
    }
    const std::complex<double> squared = lambda * lambda;
    squared_re[pair] = squared.real();
    squared_im[pair] = squared.imag();
    for (Eigen::Index row = 0; row < kRows; ++row) {
      const auto i = static_cast<std::size_t>(row);
      const std::complex<double> twice = 2.0 * T(row, k);  // z + conj(z) = 2 Re z
      into[2 * pair][i] = inverse(k, row).real();
      into[2 * pair + 1][i] = inverse(k, row).imag();
      back[i][2 * pair] = twice.real();
      back[i][2 * pair + 1] = -twice.imag();
      shift[i][2 * pair] = (twice * squared).real();
      shift[i][2 * pair + 1] = -(twice * squared).imag();
    }
    ++pair;
  }
}

void GaussCollocation::integrals(double c, double* b) const {
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

const GaussCollocation& gauss_collocation() {
  static const GaussCollocation rule;
  return rule;
}

}  // namespace oblique::solver
