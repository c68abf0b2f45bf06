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
    BandedLu<kBandwidth> banded;
    banded.set_zero(rows);
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

TEST(BandedLu, ABlockIsItsEntriesOneByOneAndAMatrixSetToZeroIsANewOne) {
  const Eigen::Matrix2d block{{4.0, 1.0}, {2.0, 3.0}};
  BandedLu<1> by_block;
  BandedLu<1> by_entries;
  by_block.set_zero(4);
  by_block.add_block(0, 0, block);
  by_block.set_zero(3);
  by_entries.set_zero(3);
  by_block.add_block(1, 1, block);
  by_block.add(0, 0, 1.0);
  by_entries.add(0, 0, 1.0);
  by_entries.add(1, 1, 4.0);
  by_entries.add(1, 2, 1.0);
  by_entries.add(2, 1, 2.0);
  by_entries.add(2, 2, 3.0);
  ASSERT_TRUE(by_block.factor());
  ASSERT_TRUE(by_entries.factor());
  std::vector<double> x{1.0, 2.0, 3.0};
  std::vector<double> y = x;
  by_block.solve(x);
  by_entries.solve(y);
  EXPECT_EQ(x, y);
}

TEST(BandedLu, TellsASingularMatrix) {
  BandedLu<1> matrix;
  matrix.set_zero(3);
  matrix.add(0, 0, 1.0);
  matrix.add(1, 0, 1.0);
  matrix.add(2, 2, 1.0);
  EXPECT_FALSE(matrix.factor());
}

}  // namespace
}  // namespace oblique::solver
