#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/banded.h"
#include "worker/solver/reference/chain.h"

namespace oblique::solver {

/// The chain of the paper. Every link has its own nodes; pin and joints are constraints:
///
///   M q'' + Phi_qᵀ lambda + dU/dq = Q + F_c,   Phi(q) = 0        (eqs. 14 to 16)
///
/// Unknowns are interleaved along the chain, so that every matrix is banded: for each link the
/// multiplier of its inner end, then position and slope of each node. Coordinates have a column of
/// zeros for each multiplier.
class ConstrainedChain : public ElementChain {
 public:
  /// An element has eight unknowns. A multiplier couples to unknowns at most five before it.
  static constexpr std::size_t kBandwidth = 7;
  using Matrix = BandedLu<kBandwidth>;

  /// Throws InputError when `model` is outside its domain.
  explicit ConstrainedChain(const ModelParameters& model);

  Eigen::Index multiplier_row(std::size_t link) const { return joints_[link].multiplier; }

  /// residual += M q''.
  void add_inertia(const Coordinates& acceleration, Coordinates& residual) const;
  /// residual += dU/dq - Q (eqs. 11 and 12).
  void add_elastic_and_gravity(const Coordinates& q, Coordinates& residual) const;
  /// Eq. 14: residual += Phi_qᵀ lambda in the rows of coordinates.
  void add_constraint_forces(const Coordinates& multipliers_N, Coordinates& residual) const;
  /// residual = factor Phi(q) in the rows of multipliers.
  void set_constraints(const Coordinates& q, double factor, Coordinates& residual) const;
  /// Returns the multipliers among the unknowns, one column per link, and sets them to zero there.
  Coordinates take_multipliers(Coordinates& unknowns) const;

  /// matrix += mass_factor M + stiffness_factor d2U/dq2(q) + Phi_q and its transpose.
  void add_tangent(const Coordinates& q, double mass_factor, double stiffness_factor,
                   Matrix& matrix) const;
  /// product += d2U/dq2(q) direction.
  void add_stiffness_product(const Coordinates& q, const Coordinates& direction,
                             Coordinates& product) const;

  double kinetic_energy_J(const Coordinates& v) const override;

 private:
  /// The inner end of a link.
  struct Joint {
    Eigen::Index multiplier;
    Eigen::Index position;  ///< position of the link's first node
    Eigen::Index before;    ///< position of the previous link's last node; -1 at the pin
  };
  Eigen::Matrix4d mass_of(const Element& element) const {
    return mass_matrix(mass_per_length_, length_of(element));
  }

  double tip_mass_kg_;
  std::vector<Joint> joints_;  ///< the pin first
};

}  // namespace oblique::solver
