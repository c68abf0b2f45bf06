#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace oblique::solver {

/// A square banded matrix, of no rows to begin with, `bandwidth` diagonals on either side, and its
/// LU factors with partial pivoting inside the band: work and memory are linear in the number of
/// rows, and a zero on the diagonal (a multiplier's row) does no harm. By hand: Eigen has no banded
/// factorisation.
template <std::size_t bandwidth>
class BandedLu {
 public:
  /// A matrix of zeros of that size. Allocates when the size grows.
  void set_zero(std::size_t rows) {
    rows_.resize(rows);
    pivots_.resize(rows);
    for (auto& row : rows_) {
      row.fill(0.0);
    }
  }
  /// Needs |row - column| <= bandwidth.
  void add(std::size_t row, std::size_t column, double value) {
    rows_[row][column + bandwidth - row] += value;
  }

  /// Adds a dense block whose first entry is (row, column).
  template <class Block>
  void add_block(std::size_t row, std::size_t column, const Block& block) {
    for (int i = 0; i < block.rows(); ++i) {
      double* target = &entry(row + static_cast<std::size_t>(i), column);
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

  /// Solves in place. Needs a successful factor().
  void solve(std::span<double> x) const {
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
  /// Columns right of the diagonal after row exchanges.
  static constexpr std::size_t kReach = 2 * bandwidth;

  // Row i holds columns i - bandwidth .. i + 2 bandwidth, and room for one exchange.
  double& entry(std::size_t i, std::size_t j) { return rows_[i][j + bandwidth - i]; }
  double entry(std::size_t i, std::size_t j) const { return rows_[i][j + bandwidth - i]; }

  std::vector<std::array<double, 3 * bandwidth + 1>> rows_;
  std::vector<std::size_t> pivots_;
};

}  // namespace oblique::solver
