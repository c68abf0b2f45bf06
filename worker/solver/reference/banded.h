#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "worker/solver/reference/chain_kernel.h"

/// Banded matrices and their factors, which Eigen does not provide.
namespace oblique::solver {

/// Symmetric matrix of half-bandwidth 3, lower part by rows: at(i, d) is entry (i, i - d).
class BandedMatrix {
 public:
  explicit BandedMatrix(std::size_t rows = 0) : bands_(rows) {}

  std::size_t rows() const { return bands_.size(); }
  double& at(std::size_t row, std::size_t distance) { return bands_[row][distance]; }
  double at(std::size_t row, std::size_t distance) const { return bands_[row][distance]; }

  /// Adds to the entry (row, column) of the lower part. |row - column| <= kHalfBandwidth.
  void add(std::size_t row, std::size_t column, double value) {
    if (row >= column) {
      bands_[row][row - column] += value;
    }
  }

  /// x^T A x for the entries x[0], x[2], x[4], ...
  double quadratic_form(const double* x) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < rows(); ++i) {
      sum += bands_[i][0] * x[2 * i] * x[2 * i];
      for (std::size_t d = 1; d <= kHalfBandwidth && d <= i; ++d) {
        sum += bands_[i][d] * (2.0 * x[2 * i] * x[2 * (i - d)]);
      }
    }
    return sum;
  }

 private:
  std::vector<std::array<double, kHalfBandwidth + 1>> bands_;
};

/// A = L D Lᵀ of a symmetric positive definite banded matrix, L with unit diagonal.
class BandedCholesky {
 public:
  BandedCholesky() = default;
  /// Factors `matrix` as far as it is positive definite.
  explicit BandedCholesky(const BandedMatrix& matrix) : rows_(matrix.rows() + kHalfBandwidth) {
    std::vector<double> pivots(rows_.size());
    for (std::size_t i = 0; i < matrix.rows(); ++i) {
      for (std::size_t d = std::min(kHalfBandwidth, i); d >= 1; --d) {
        const std::size_t j = i - d;
        double entry = matrix.at(i, d);
        for (std::size_t m = 1; m + d <= kHalfBandwidth && m <= j; ++m) {
          entry -= rows_[i].left[d + m - 1] * rows_[j].left[m - 1] * pivots[j - m];
        }
        rows_[i].left[d - 1] = entry / pivots[j];
      }
      pivots[i] = matrix.at(i, 0);
      for (std::size_t d = 1; d <= kHalfBandwidth && d <= i; ++d) {
        pivots[i] -= rows_[i].left[d - 1] * rows_[i].left[d - 1] * pivots[i - d];
      }
      if (!(pivots[i] > 0.0)) {
        positive_definite_ = false;
        return;
      }
      rows_[i].inverse_pivot = 1.0 / pivots[i];
    }
  }

  bool positive_definite() const { return positive_definite_; }

  /// Solves A z = f in place for two right-hand sides f[2 i + c]. Requires positive_definite().
  void solve_pairs(double* f) const {
    ForwardSubstitution<double> forward;
    const std::size_t rows = rows_.size() - kHalfBandwidth;
    for (std::size_t i = 0; i < rows; ++i) {
      put_pair(f, i, forward.next(rows_[i], f[2 * i], f[2 * i + 1]));
    }
    substitute_back(rows_.data(), rows, 0, f, [f](std::size_t i, double x, double y) {
      put_pair(f, i, PlanarVector<double>{x, y});
    });
  }

  /// Returns the rows of the factors, followed by kHalfBandwidth rows of zeros.
  const FactorRow<double>* data() const { return rows_.data(); }

 private:
  std::vector<FactorRow<double>> rows_;
  bool positive_definite_ = true;
};

/// A square matrix with `bandwidth` diagonals on either side, and its LU factors with partial
/// pivoting inside the band. Zeros on the diagonal, as in multipliers' rows, are allowed.
template <std::size_t bandwidth>
class BandedLu {
 public:
  /// A matrix of zeros.
  explicit BandedLu(std::size_t rows) : rows_(rows), pivots_(rows) {}

  /// |row - column| <= bandwidth.
  void add(std::size_t row, std::size_t column, double value) {
    rows_[row][column + bandwidth - row] += value;
  }

  /// Adds a dense square block whose first entry is (first, first).
  template <class Block>
  void add_block(std::size_t first, const Block& block) {
    for (int i = 0; i < block.rows(); ++i) {
      double* target = &entry(first + static_cast<std::size_t>(i), first);
      for (int j = 0; j < block.cols(); ++j) {
        target[j] += block(i, j);
      }
    }
  }

  /// Factors in place; false when the matrix is singular to working precision.
  bool factor() {
    const std::size_t n = rows_.size();
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t last_row = std::min(n - 1, k + bandwidth);
      std::size_t pivot = k;
      for (std::size_t i = k + 1; i <= last_row; ++i) {
        if (std::abs(entry(i, k)) > std::abs(entry(pivot, k))) {
          pivot = i;
        }
      }
      pivots_[k] = pivot;
      if (!(std::abs(entry(pivot, k)) > 0.0)) {
        return false;
      }
      if (pivot != k) {
        std::swap_ranges(&entry(k, k), &entry(k, k) + kReach + 1, &entry(pivot, k));
      }
      for (std::size_t i = k + 1; i <= last_row; ++i) {
        const double factor = entry(i, k) / entry(k, k);
        entry(i, k) = factor;
        double* target = &entry(i, k);
        const double* source = &entry(k, k);
        for (std::size_t j = 1; j <= kReach; ++j) {
          target[j] -= factor * source[j];
        }
      }
    }
    return true;
  }

  /// Solves in place. Requires a successful factor().
  void solve(double* x) const {
    const std::size_t n = rows_.size();
    for (std::size_t k = 0; k < n; ++k) {
      std::swap(x[k], x[pivots_[k]]);
      const std::size_t last_row = std::min(n - 1, k + bandwidth);
      for (std::size_t i = k + 1; i <= last_row; ++i) {
        x[i] -= entry(i, k) * x[k];
      }
    }
    for (std::size_t k = n; k-- > 0;) {
      const std::size_t last_column = std::min(n - 1, k + kReach);
      for (std::size_t j = k + 1; j <= last_column; ++j) {
        x[k] -= entry(k, j) * x[j];
      }
      x[k] /= entry(k, k);
    }
  }

 private:
  /// Number of columns right of the diagonal that row exchanges can fill.
  static constexpr std::size_t kReach = 2 * bandwidth;

  // Row i contains columns i - bandwidth .. i + kReach; row exchanges fill the last `bandwidth`.
  double& entry(std::size_t i, std::size_t j) { return rows_[i][j + bandwidth - i]; }
  double entry(std::size_t i, std::size_t j) const { return rows_[i][j + bandwidth - i]; }

  std::vector<std::array<double, 3 * bandwidth + 1>> rows_;
  std::vector<std::size_t> pivots_;
};

}  // namespace oblique::solver
