#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "worker/solver/chain/banded_lu.h"
#include "worker/solver/chain/beam_element.h"
#include "worker/solver/chain/beam_tangent.h"
#include "worker/solver/chain/chain.h"
#include "worker/solver/model/parameters.h"

namespace oblique::solver {

/// The chain as the paper has it: every link with nodes of its own, the pin and the joints as
/// constraints Phi(q) = 0, multipliers lambda as unknowns:
///
///   M q'' + Phi_qᵀ lambda + dU/dq = Q + F_c,   Phi(q) = 0        (paper, eqs. 14 to 16)
///
/// Unknowns are interleaved along the chain, so that every matrix is banded: for each link the
/// multiplier of its inner end, then position and slope of each node, each x before y. Coordinates
/// of this chain have a column for each of these, with zeros at the multipliers' places.
class ConstrainedChain {
 public:
  /// An element spans eight unknowns; a multiplier reaches five back, over the last node before it.
  static constexpr std::size_t kBandwidth = 7;
  using Matrix = BandedLu<kBandwidth>;
  static_assert(std::is_same_v<Matrix, decltype(StepRoom::matrix)>);

  /// Throws InputError when `model` is outside its domain.
  explicit ConstrainedChain(const ModelParameters& model);

  Eigen::Index columns() const { return columns_; }
  Eigen::Index links() const { return static_cast<Eigen::Index>(links_.size()); }
  Eigen::Index tip_column() const { return columns_ - 2; }
  Eigen::Index multiplier_column(Eigen::Index link) const { return at(link).multiplier; }

  /// Straight, horizontal, unstressed, at rest. Accelerations and multipliers are left empty.
  ChainState at_rest() const;
  TipState tip(const ChainState& state) const;

  /// The state of the eliminated chain `eliminated`, read in these coordinates.
  ChainState from_eliminated(const ChainState& eliminated) const;

  /// residual += M q''.
  void add_inertia(const Coordinates& acceleration, Coordinates& residual) const;
  /// residual += dU/dq - Q.
  void add_elastic_and_gravity(const Coordinates& q, Coordinates& residual) const;
  /// residual += Phi_qᵀ lambda in the columns of coordinates.
  void add_constraint_forces(const Coordinates& multipliers_N, Coordinates& residual) const;
  /// residual = factor Phi(q) in the columns of multipliers.
  void set_constraints(const Coordinates& q, double factor, Coordinates& residual) const;
  /// Takes the multipliers out of a vector of unknowns, a column a link, and leaves zeros.
  void take_multipliers(Coordinates& unknowns, Coordinates& multipliers) const;

  /// matrix += mass_factor M + stiffness_factor d2U/dq2(q) + Phi_q and its transpose.
  void add_tangent(const Coordinates& q, double mass_factor, double stiffness_factor,
                   Matrix& matrix) const;
  /// product += d2U/dq2(q) direction.
  void add_stiffness_product(const Coordinates& q, const Coordinates& direction,
                             Coordinates& product) const;

  double kinetic_energy_J(const Coordinates& v) const;
  double strain_energy_J(const Coordinates& q) const;
  double gravity_energy_J(const Coordinates& q) const;
  Eigen::Vector2d momentum_Ns(const Coordinates& v) const;
  /// O first, then the outer end of each element.
  Coordinates node_positions_m(const Coordinates& q) const;

 private:
  struct Element {
    Eigen::Index first;  ///< column of its inner node's position
    double inverse_length;
    double half_EA_length;
    double bending;
    GradientMap B;
    Eigen::Matrix4d M;  ///< of one direction
  };
  struct Link {
    Eigen::Index multiplier;
    Eigen::Index inner;  ///< column of the position of its first node
    Eigen::Index outer;  ///< column of the position of its last node
  };
  const Link& at(Eigen::Index link) const { return links_[static_cast<std::size_t>(link)]; }
  static GradientCoefficients gradient(const Element& element, const Coordinates& q);
  static ElementTangent stiffness(const Element& element, const Coordinates& q);

  Eigen::Index columns_ = 0;
  double tip_mass_kg_;
  std::vector<Link> links_;
  std::vector<Element> elements_;
  Coordinates gravity_;  ///< Q
};

}  // namespace oblique::solver
