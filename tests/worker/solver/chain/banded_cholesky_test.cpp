#include "worker/solver/chain/banded_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace oblique::solver {
namespace {

struct Sample {
  BandedMatrix banded;
  Eigen::MatrixXd dense;
};

/// Random symmetric matrix of half-bandwidth 3 with `diagonal` added: positive definite for a large
/// one.
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

TEST(BandedCholesky, TellsAMatrixThatIsNotPositiveDefinite) {
  std::mt19937_64 generator(2);
  for (int trial = 0; trial < 200; ++trial) {
    // A diagonal of about 1 beside entries up to 1: some are, some are not.
    const Sample sample = random_matrix(6, 1.8, generator);
    const double smallest =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(sample.dense).eigenvalues().minCoeff();
    if (std::abs(smallest) > 1e-10) {
      EXPECT_EQ(BandedCholesky(sample.banded).positive_definite(), smallest > 0.0);
    }
  }
}

TEST(BandedCholesky, TellsAMatrixWithNaN) {
  BandedMatrix matrix(2);
  matrix.at(0, 0) = 1.0;
  matrix.at(1, 0) = std::numeric_limits<double>::quiet_NaN();
  matrix.at(1, 1) = 1.0;
  EXPECT_FALSE(BandedCholesky(matrix).positive_definite());
}

TEST(BandedMatrix, BilinearFormTakesEveryOtherEntryOfInterleavedVectors) {
  std::mt19937_64 generator(3);
  const Sample sample = random_matrix(9, 0.0, generator);
  const Eigen::VectorXd left = Eigen::VectorXd::Random(9);
  const Eigen::VectorXd right = Eigen::VectorXd::Random(9);
  std::vector<double> interleaved_left(18, 7.0);
  std::vector<double> interleaved_right(18, 7.0);
  for (Eigen::Index i = 0; i < 9; ++i) {
    interleaved_left[static_cast<std::size_t>(2 * i)] = left[i];
    interleaved_right[static_cast<std::size_t>(2 * i)] = right[i];
  }
  EXPECT_NEAR(sample.banded.bilinear(interleaved_left.data(), interleaved_right.data(), 2),
              left.dot(sample.dense * right), 1e-14);
}

}  // namespace
}  // namespace oblique::solver
