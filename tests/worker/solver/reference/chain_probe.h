#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "worker/solver/reference/chain.h"

namespace oblique::solver {

/// Returns the rows that contain positions; the first row is the pin. The other rows contain
/// slopes: one per node, two per joint.
inline std::vector<Eigen::Index> position_rows(const ModelParameters& model) {
  std::vector<Eigen::Index> rows{0};
  const std::size_t links = model.lengths_m.size();
  for (std::size_t link = 0; link < links; ++link) {
    for (int e = 1; e <= model.elements_per_link; ++e) {
      const bool ends_at_joint = e == model.elements_per_link && link + 1 < links;
      rows.push_back(rows.back() + (ends_at_joint ? 3 : 2));
    }
  }
  return rows;
}

/// Computes dense matrices of a chain from energies and accelerations alone. Entry i belongs to row
/// i + 1, because row 0 is the fixed pin. Both directions have the same mass matrix.
class ChainProbe {
 public:
  explicit ChainProbe(const Chain& chain) : chain_(chain) {
    const Eigen::Index n = chain.rows() - 1;
    mass_.resize(n, n);
    gravity_.resize(n, 2);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        // The kinetic energy T of unit velocities gives M_ij = T(i + j) - T(i) - T(j).
        const double entry =
            i == j ? 2.0 * kinetic({i, i}) : kinetic({i, j}) - kinetic({i, i}) - kinetic({j, j});
        mass_(i, j) = entry;
        mass_(j, i) = entry;
      }
      for (Eigen::Index c = 0; c < 2; ++c) {
        Coordinates q = Coordinates::Zero(2, chain.rows());
        q(c, i + 1) = 1.0;
        gravity_(i, c) = -chain.gravity_energy_J(q);
      }
    }
  }

  using Pairs = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

  const Eigen::MatrixXd& mass() const { return mass_; }
  const Pairs& gravity() const { return gravity_; }

  /// Returns the accelerations of all rows except the pin.
  Pairs accelerations(const Coordinates& q, double ft_N, double fn_N) const {
    Coordinates a(2, q.cols());
    chain_.accelerations(q.data(), ft_N, fn_N, a.data());
    return a.rightCols(mass_.rows()).transpose();
  }

  /// Returns the elastic force -dU/dq, computed as M q'' - Q.
  Pairs elastic_force(const Coordinates& q) const {
    return mass_ * accelerations(q, 0.0, 0.0) - gravity_;
  }

  /// Returns the coordinates of a randomly deformed chain with the pin at the origin.
  Coordinates random_coordinates(std::mt19937_64& generator, double size) const {
    std::uniform_real_distribution<double> uniform(-size, size);
    Coordinates q = chain_.at_rest().q;
    for (Eigen::Index i = 2; i < q.size(); ++i) {
      q(i) += uniform(generator);
    }
    return q;
  }

 private:
  struct Rows {
    Eigen::Index i;
    Eigen::Index j;
  };
  double kinetic(const Rows& rows) const {
    Coordinates v = Coordinates::Zero(2, chain_.rows());
    v(0, rows.i + 1) = 1.0;
    v(0, rows.j + 1) = 1.0;
    return chain_.kinetic_energy_J(v);
  }

  const Chain& chain_;
  Eigen::MatrixXd mass_;
  Pairs gravity_;
};

}  // namespace oblique::solver
