#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "worker/solver/chain/chain_kernel.h"

namespace oblique::solver {

/// Symmetric matrix of half-bandwidth 3, lower part by rows: at(i, d) is entry (i, i - d).
class BandedMatrix {
 public:
  explicit BandedMatrix(std::size_t rows) : bands_(rows) {}

  std::size_t rows() const { return bands_.size(); }
  double& at(std::size_t row, std::size_t distance) { return bands_[row][distance]; }
  double at(std::size_t row, std::size_t distance) const { return bands_[row][distance]; }

  /// Adds to the entry (row, column) and, by symmetry, (column, row).
  /// Needs |row - column| <= kHalfBandwidth.
  void add(std::size_t row, std::size_t column, double value) {
    if (row >= column) {
      bands_[row][row - column] += value;
    }
  }

  /// Sum over entries of left_i A_ij right_j for vectors of stride `stride`.
  double bilinear(const double* left, const double* right, std::size_t stride) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < rows(); ++i) {
      sum += bands_[i][0] * left[i * stride] * right[i * stride];
      for (std::size_t d = 1; d <= kHalfBandwidth && d <= i; ++d) {
        const std::size_t j = i - d;
        sum += bands_[i][d] *
               (left[i * stride] * right[j * stride] + left[j * stride] * right[i * stride]);
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
  /// Factors `matrix`; `positive_definite()` tells whether that succeeded.
  explicit BandedCholesky(const BandedMatrix& matrix) : rows_(matrix.rows() + kHalfBandwidth) {
    std::vector<double> pivots(rows_.size());
    for (std::size_t i = 0; i < matrix.rows(); ++i) {
      for (std::size_t d = kHalfBandwidth; d >= 1; --d) {
        if (d > i) {
          continue;
        }
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

  /// Solves A z = f in place for two right-hand sides interleaved by rows: f[2 i + c].
  /// `Real` is a number or a pack of lanes. Needs positive_definite().
  template <class Real>
  void solve_pairs(Real* f) const {
    ForwardSubstitution<Real> forward;
    const std::size_t rows = rows_.size() - kHalfBandwidth;
    for (std::size_t i = 0; i < rows; ++i) {
      put_pair(f, i, forward.next(rows_[i], f[2 * i], f[2 * i + 1]));
    }
    substitute_back(rows_.data(), rows, 0, f, [&](std::size_t i, const Real& x, const Real& y) {
      put_pair(f, i, PlanarVector<Real>{x, y});
    });
  }

  /// Its rows, and kHalfBandwidth more of zeros.
  const FactorRow<double>* data() const { return rows_.data(); }

 private:
  std::vector<FactorRow<double>> rows_;
  bool positive_definite_ = true;
};

}  // namespace oblique::solver
