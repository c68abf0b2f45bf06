#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "worker/solver/chain/banded_lu.h"
#include "worker/solver/chain/beam_element.h"
#include "worker/solver/chain/chain.h"
#include "worker/solver/model/parameters.h"

namespace oblique::solver {

/// The chain as the paper has it: every link with nodes of its own, the pin and the joints as
/// constraints Phi(q) = 0, multipliers lambda as unknowns:
///
///   M q'' + Phi_qᵀ lambda + dU/dq = Q + F_c,   Phi(q) = 0        (paper, eqs. 14 to 16)
///
/// Unknowns are interleaved along the chain, so that every matrix is banded: for each link the two
/// multipliers of its inner end, then x and y of position and slope of each node. The vectors of a
/// ChainState have this layout too, with zeros at the multipliers' places.
class ConstrainedChain {
 public:
  /// An element spans eight unknowns; a multiplier reaches five back, over the last node before it.
  static constexpr std::size_t kBandwidth = 7;
  using Matrix = BandedLu<kBandwidth>;

  /// Throws InputError when `model` is outside its domain.
  explicit ConstrainedChain(const ModelParameters& model);

  std::size_t size() const { return size_; }
  std::size_t links() const { return links_.size(); }
  std::size_t tip_index() const { return size_ - 4; }
  std::size_t multiplier_index(std::size_t link) const { return links_[link].multiplier; }

  /// Straight, horizontal, unstressed, at rest. Accelerations and multipliers are left empty.
  ChainState at_rest() const;
  TipState tip(const ChainState& state) const;

  /// The state of the eliminated chain `eliminated`, read in these coordinates.
  ChainState from_eliminated(const ChainState& eliminated) const;

  /// residual += M q''.
  void add_inertia(const Coordinates& acceleration, std::vector<double>& residual) const;
  /// residual += dU/dq - Q.
  void add_elastic_and_gravity(const Coordinates& q, std::vector<double>& residual) const;
  /// residual += Phi_qᵀ lambda in the rows of coordinates.
  void add_constraint_forces(const std::vector<double>& multipliers_N,
                             std::vector<double>& residual) const;
  /// residual = factor Phi(q) in the rows of multipliers.
  void set_constraints(const Coordinates& q, double factor, std::vector<double>& residual) const;

  /// matrix += mass_factor M + stiffness_factor d2U/dq2(q) + Phi_q and its transpose.
  void add_tangent(const Coordinates& q, double mass_factor, double stiffness_factor,
                   Matrix& matrix) const;
  /// product += d2U/dq2(q) direction.
  void add_stiffness_product(const Coordinates& q, const Coordinates& direction,
                             std::vector<double>& product) const;

  double kinetic_energy_J(const Coordinates& v) const;
  double strain_energy_J(const Coordinates& q) const;
  double gravity_energy_J(const Coordinates& q) const;
  PlanarVector<double> momentum_Ns(const Coordinates& v) const;
  /// O first, then the outer end of each element.
  std::vector<PlanarVector<double>> node_positions_m(const Coordinates& q) const;

 private:
  struct Element {
    std::size_t first;  ///< index of x of its inner node's position
    double inverse_length;
    double half_EA_length;
    double bending;
    std::array<std::array<double, 4>, 4> mass;
  };
  struct Link {
    std::size_t multiplier;
    std::size_t inner;  ///< x of the position of its first node
    std::size_t outer;  ///< x of the position of its last node
  };

  std::size_t size_ = 0;
  double tip_mass_kg_;
  std::vector<Link> links_;
  std::vector<Element> elements_;
  Coordinates gravity_;
};

}  // namespace oblique::solver
