#include "worker/solver/chain/banded_lu.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cstddef>
#include <random>
#include <vector>

namespace oblique::solver {
namespace {

constexpr std::size_t kBandwidth = 3;

TEST(BandedLu, SolvesAsADenseFactorisationDoesAlsoWithZerosOnTheDiagonal) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (std::size_t rows = 1; rows <= 30; ++rows) {
    const auto n = static_cast<Eigen::Index>(rows);
    BandedLu<kBandwidth> banded(rows);
    banded.set_zero();
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t j = i < kBandwidth ? 0 : i - kBandwidth;
           j <= std::min(rows - 1, i + kBandwidth); ++j) {
        // Every third diagonal entry is zero, as a multiplier's is.
        const double value = i == j && i % 3 == 2 ? 0.0 : uniform(generator);
        banded.add(i, j, value);
        dense(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = value;
      }
    }
    std::vector<double> x(rows);
    for (double& value : x) {
      value = uniform(generator);
    }
    const Eigen::VectorXd right = Eigen::Map<Eigen::VectorXd>(x.data(), n);
    ASSERT_TRUE(banded.factor());
    banded.solve(x);
    const Eigen::VectorXd solution = Eigen::Map<Eigen::VectorXd>(x.data(), n);
    EXPECT_LT((dense * solution - right).norm(), 1e-12 * (dense.norm() * solution.norm()));
    const Eigen::VectorXd expected = dense.partialPivLu().solve(right);
    const double condition = dense.norm() * dense.inverse().norm();
    EXPECT_LT((solution - expected).norm(), 1e-14 * condition * expected.norm());
  }
}

TEST(BandedLu, TellsASingularMatrix) {
  BandedLu<1> matrix(3);
  matrix.set_zero();
  matrix.add(0, 0, 1.0);
  matrix.add(1, 0, 1.0);
  matrix.add(2, 2, 1.0);
  EXPECT_FALSE(matrix.factor());
}

}  // namespace
}  // namespace oblique::solver
