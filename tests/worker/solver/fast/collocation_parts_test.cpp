#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "worker/solver/fast/collocation_lanes.h"
#include "worker/solver/fast/front_kernel.h"
#include "worker/solver/fast/gauss_collocation.h"
#include "worker/solver/reference/beam_element.h"

namespace oblique::solver {
namespace {

constexpr double kLength_m = 0.13;
constexpr double kAxial = 37.0;   // EA l
constexpr double kBending = 2.1;  // 2 EI/l
constexpr double kMassPerLength = 1.7;

ElementConstants<double> constants() {
  return element_constants(kLength_m, kAxial / kLength_m, 0.5 * kBending * kLength_m,
                           kMassPerLength);
}

/// Returns a bent and stretched element.
ElementCoordinates bent(double more) {
  ElementCoordinates q;
  q << 0.1, 0.9 + more, 0.21, 1.1, 0.05, 0.3, 0.12 - 0.1 * more, -0.2 + more;
  return q;
}

TangentBlocks<double> tangent_of(const ElementCoordinates& q) {
  const auto pair = [&](Eigen::Index i) { return PlanarVector<double>{q(0, i), q(1, i)}; };
  return element_tangent(pair(0), pair(1), pair(2), pair(3), constants());
}

/// Dense matrix M + z K of two links with two different bent elements each, with rows as in Chain.
struct DenseChain {
  static constexpr std::size_t kLinks = 2;
  static constexpr std::size_t kElements = 2;
  static constexpr Eigen::Index kRows = 2 * kLinks * kElements + kLinks + 1;

  DenseChain() {
    for (int i = 0; i < 4; ++i) {
      blocks.push_back(tangent_of(bent(0.1 * i)));
      tangents.push_back(elastic_tangent(bent(0.1 * i), constants()));
    }
  }
  Eigen::MatrixXcd matrix(std::complex<double> z) const {
    Eigen::MatrixXcd A = Eigen::MatrixXcd::Zero(2 * kRows, 2 * kRows);
    const Eigen::Matrix4d m = mass_matrix(kMassPerLength, kLength_m);
    Eigen::Index row = 0;
    for (std::size_t e = 0; e < blocks.size(); ++e) {
      const bool at_joint = e == 1;
      const std::array<Eigen::Index, 4> rows{row, row + 1, row + (at_joint ? 3 : 2),
                                             row + (at_joint ? 2 : 3)};
      const ElementTangent M = in_both_directions(m);
      const ElementTangent& K = tangents[e];
      for (Eigen::Index i = 0; i < 8; ++i) {
        for (Eigen::Index j = 0; j < 8; ++j) {
          A(2 * rows[static_cast<std::size_t>(i / 2)] + i % 2,
            2 * rows[static_cast<std::size_t>(j / 2)] + j % 2) += M(i, j) + z * K(i, j);
        }
      }
      row = rows[2];
    }
    for (const Eigen::Index tip : {2 * row, 2 * row + 1}) {
      A(tip, tip) += kTip_kg;
    }
    A.topRows(2).setZero();
    A.leftCols(2).setZero();
    A(0, 0) = A(1, 1) = 1.0;
    return A;
  }
  static constexpr double kTip_kg = 0.3;
  std::vector<TangentBlocks<double>> blocks;
  std::vector<ElementTangent> tangents;
};

TEST(FrontKernel, SolvesAsTheDenseMatrixDoes) {
  const DenseChain chain;
  const std::complex<double> z(-0.011, 0.023);
  const std::vector<ElementConstants<double>> links(DenseChain::kLinks, constants());
  ChainTables<double> tables{};
  tables.links = DenseChain::kLinks;
  tables.elements_per_link = DenseChain::kElements;
  tables.link = links.data();
  tables.tip_mass_kg = &DenseChain::kTip_kg;
  tables.rows = static_cast<std::size_t>(DenseChain::kRows);
  std::vector<Complex<double>> factors(chain_factors(DenseChain::kLinks, DenseChain::kElements));
  factor_fronts(tables, chain.blocks.data(), {z.real(), z.imag()}, factors.data());
  constexpr auto kSize = static_cast<std::size_t>(2 * DenseChain::kRows);
  Eigen::VectorXcd right = Eigen::VectorXcd::Zero(2 * DenseChain::kRows);
  std::vector<double> x(2 * kSize, 0.0);
  for (std::size_t i = 2; i < kSize; ++i) {
    x[i] = std::sin(1.0 + static_cast<double>(i));
    x[kSize + i] = std::cos(3.0 * static_cast<double>(i));
    right[static_cast<Eigen::Index>(i)] = {x[i], x[kSize + i]};
  }
  solve_fronts<1>(tables, factors.data(), x.data());
  const Eigen::VectorXcd exact = chain.matrix(z).partialPivLu().solve(right);
  for (std::size_t i = 0; i < kSize; ++i) {
    const std::complex<double> value = exact[static_cast<Eigen::Index>(i)];
    EXPECT_NEAR(x[i], value.real(), 1e-12 * exact.norm()) << i;
    EXPECT_NEAR(x[kSize + i], value.imag(), 1e-12 * exact.norm()) << i;
  }
}

TEST(GaussCollocation, IntegratesPolynomialsExactly) {
  const GaussCollocation& rule = gauss_collocation();
  for (int degree = 0; degree < 2 * static_cast<int>(GaussCollocation::kStages); ++degree) {
    double sum = 0.0;
    for (std::size_t i = 0; i < GaussCollocation::kStages; ++i) {
      sum += rule.weight[i] * std::pow(rule.node[i], degree);
    }
    EXPECT_NEAR(sum, 1.0 / (degree + 1), 1e-15) << degree;
  }
  for (int degree = 0; degree < static_cast<int>(GaussCollocation::kStages); ++degree) {
    double b[GaussCollocation::kStages];
    rule.integrals(0.37, b);
    double sum = 0.0;
    for (std::size_t i = 0; i < GaussCollocation::kStages; ++i) {
      sum += b[i] * std::pow(rule.node[i], degree);
    }
    EXPECT_NEAR(sum, std::pow(0.37, degree + 1) / (degree + 1), 1e-15) << degree;
  }
}

TEST(GaussCollocation, DiagonalisesTheSquareOfItsMatrix) {
  const GaussCollocation& rule = gauss_collocation();
  for (std::size_t i = 0; i < GaussCollocation::kStages; ++i) {
    for (std::size_t j = 0; j < GaussCollocation::kStages; ++j) {
      double unit = 0.0;
      double square = 0.0;
      double exact = 0.0;
      for (std::size_t k = 0; k < GaussCollocation::kStages; ++k) {
        unit += rule.back[i][k] * rule.into[k][j];
        square += rule.shift[i][k] * rule.into[k][j];
        exact += rule.integral[i][k] * rule.integral[k][j];
      }
      EXPECT_NEAR(unit, i == j ? 1.0 : 0.0, 1e-11);
      EXPECT_NEAR(square, exact, 1e-13);
    }
  }
}

TEST(CollocationLanes, HalvingTheStepReducesTheErrorAThousandfold) {
  // The chain is so soft that the steps resolve all its vibrations.
  ModelParameters model = preset("paper");
  model.elements_per_link = 1;
  model.E_Pa = 1e5;
  const Chain chain(model);
  const auto state_after = [&](int steps) -> Eigen::VectorXd {
    CollocationLanes lanes(runnable_lane_kernels().front(), chain);
    const std::size_t lane = lanes.lanes() - 1;
    lanes.step(lane).h_s = 0.2 / steps;
    lanes.step(lane).error_m = 1e-14;
    for (int i = 0; i < steps; ++i) {
      lanes.attempt();
      EXPECT_TRUE(lanes.step(lane).converged);
      lanes.accept();
    }
    const std::vector<double> numbers = lanes.state(lane);
    return Eigen::Map<const Eigen::VectorXd>(numbers.data(), 2 * chain.rows());
  };
  const Eigen::VectorXd exact = state_after(28);
  const double coarse = (state_after(5) - exact).norm();
  const double fine = (state_after(10) - exact).norm();
  EXPECT_GT(coarse, 1e-8) << "otherwise rounding dominates";
  EXPECT_GT(coarse / fine, 1000.0)
      << "at least order 10; order 16 is reached only where rounding hides it";
}

}  // namespace
}  // namespace oblique::solver
