#include "worker/solver/reference/banded.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

namespace oblique::solver {
namespace {

struct Sample {
  BandedMatrix banded;
  Eigen::MatrixXd dense;
};

/// Returns a random symmetric matrix of half-bandwidth 3 plus `diagonal` times the identity. It is
/// positive definite if `diagonal` is large.
Sample random_matrix(std::size_t rows, double diagonal, std::mt19937_64& generator) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto n = static_cast<Eigen::Index>(rows);
  Sample sample{BandedMatrix(rows), Eigen::MatrixXd::Zero(n, n)};
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j = i < kHalfBandwidth ? 0 : i - kHalfBandwidth; j <= i; ++j) {
      const double value = uniform(generator) + (i == j ? diagonal : 0.0);
      sample.banded.add(i, j, value);
      const auto row = static_cast<Eigen::Index>(i);
      const auto column = static_cast<Eigen::Index>(j);
      sample.dense(row, column) = value;
      sample.dense(column, row) = value;
    }
  }
  return sample;
}

TEST(BandedCholesky, SolvesAsADenseFactorisationDoes) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (std::size_t rows = kHalfBandwidth; rows <= 30; ++rows) {
    const Sample sample = random_matrix(rows, 5.0, generator);
    const BandedCholesky factor(sample.banded);
    ASSERT_TRUE(factor.positive_definite());
    std::vector<double> f(2 * rows);
    for (double& value : f) {
      value = uniform(generator);
    }
    using Pairs = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
    const Pairs right = Eigen::Map<Pairs>(f.data(), static_cast<Eigen::Index>(rows), 2);
    factor.solve_pairs(f.data());
    const Pairs solution = Eigen::Map<Pairs>(f.data(), static_cast<Eigen::Index>(rows), 2);
    EXPECT_LT((solution - sample.dense.llt().solve(right)).norm(), 1e-14) << rows << " rows";
  }
}

TEST(BandedCholesky, DetectsAMatrixThatIsNotPositiveDefinite) {
  std::mt19937_64 generator(2);
  for (int trial = 0; trial < 200; ++trial) {
    // This diagonal makes only some of the matrices positive definite.
    const Sample sample = random_matrix(6, 1.8, generator);
    const double smallest =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(sample.dense).eigenvalues().minCoeff();
    if (std::abs(smallest) > 1e-10) {
      EXPECT_EQ(BandedCholesky(sample.banded).positive_definite(), smallest > 0.0);
    }
  }
}

TEST(BandedMatrix, QuadraticFormUsesEveryOtherEntryOfAnInterleavedVector) {
  std::mt19937_64 generator(3);
  const Sample sample = random_matrix(9, 0.0, generator);
  const Eigen::VectorXd x = Eigen::VectorXd::Random(9);
  std::vector<double> interleaved(18, 7.0);
  for (Eigen::Index i = 0; i < 9; ++i) {
    interleaved[static_cast<std::size_t>(2 * i)] = x[i];
  }
  EXPECT_NEAR(sample.banded.quadratic_form(interleaved.data()), x.dot(sample.dense * x), 1e-14);
}

constexpr std::size_t kBandwidth = 3;

TEST(BandedLu, SolvesAsADenseFactorisationDoesEvenWithZerosOnTheDiagonal) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (std::size_t rows = 1; rows <= 30; ++rows) {
    const auto n = static_cast<Eigen::Index>(rows);
    BandedLu<kBandwidth> banded(rows);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t j = i < kBandwidth ? 0 : i - kBandwidth;
           j <= std::min(rows - 1, i + kBandwidth); ++j) {
        // Every third diagonal entry is zero, like the entry of a Lagrange multiplier.
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
    banded.solve(x.data());
    const Eigen::VectorXd solution = Eigen::Map<Eigen::VectorXd>(x.data(), n);
    EXPECT_LT((dense * solution - right).norm(), 1e-12 * (dense.norm() * solution.norm()));
    const Eigen::VectorXd expected = dense.partialPivLu().solve(right);
    const double condition = dense.norm() * dense.inverse().norm();
    EXPECT_LT((solution - expected).norm(), 1e-14 * condition * expected.norm());
  }
}

TEST(BandedLu, AddingABlockEqualsAddingItsEntries) {
  const Eigen::Matrix2d block{{4.0, 1.0}, {2.0, 3.0}};
  BandedLu<1> by_block(3);
  BandedLu<1> by_entries(3);
  by_block.add_block(1, block);
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
  by_block.solve(x.data());
  by_entries.solve(y.data());
  EXPECT_EQ(x, y);
}

TEST(BandedLu, DetectsASingularMatrix) {
  BandedLu<1> matrix(3);
  matrix.add(0, 0, 1.0);
  matrix.add(1, 0, 1.0);
  matrix.add(2, 2, 1.0);
  EXPECT_FALSE(matrix.factor());
}

}  // namespace
}  // namespace oblique::solver
