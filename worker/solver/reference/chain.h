#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/banded.h"
#include "worker/solver/reference/beam_element.h"
#include "worker/solver/reference/tip.h"

namespace oblique::solver {

/// Positions and slopes of a chain, or their rates, one per column, x above y.
using Coordinates = Eigen::Matrix2Xd;

struct ChainState {
  double t_s = 0.0;  ///< since release
  Coordinates q;     ///< [m] and [-]
  Coordinates v;     ///< [m/s] and [1/s]
  // Only for generalized-alpha; else empty.
  Coordinates acceleration;  ///< q'' at t_s
  /// (a - q'')/h, where a is q'' at a fixed fraction of a step later. Empty after a restart.
  Coordinates algorithmic_offset_rate;
  Coordinates multipliers_N;  ///< one column per link
};

struct Energies {
  double kinetic_J;
  double strain_J;   ///< 0 when unstressed
  double gravity_J;  ///< 0 at the height of O
};

/// The elements of all links; immutable. Derived classes assign columns of Coordinates to elements.
class ElementChain {
 public:
  virtual ~ElementChain() = default;

  /// Number of columns of Coordinates and of rows of matrices.
  Eigen::Index rows() const { return rows_; }
  Eigen::Index tip_row() const { return rows_ - 2; }
  std::size_t links() const { return constants_.size(); }
  double gravity_m_s2() const { return gravity_m_s2_; }
  double length_m() const;
  double mass_kg() const { return mass_kg_; }

  /// Straight, horizontal, unstressed, at rest (paper, section 2).
  ChainState at_rest() const;
  TipState tip(const ChainState& state) const;
  /// Eq. 5, tip mass included.
  virtual double kinetic_energy_J(const Coordinates& v) const = 0;
  /// Eq. 7, of all elements.
  double strain_energy_J(const Coordinates& q) const;
  double gravity_energy_J(const Coordinates& q) const { return -q.row(1).dot(weight_N_); }
  Energies energies(const ChainState& state) const {
    return {kinetic_energy_J(state.v), strain_energy_J(state.q), gravity_energy_J(state.q)};
  }
  Eigen::Vector2d momentum_Ns(const Coordinates& v) const { return v * momentum_kg_; }
  /// O first, then the outer end of each element.
  Coordinates node_positions_m(const Coordinates& q) const;

 protected:
  struct Element {
    std::array<Eigen::Index, 4> row;  ///< rows of p_i, s_i, p_j, s_j
    std::size_t link;
  };

  /// Adds no elements. Throws InputError when `model` is outside its domain.
  explicit ElementChain(const ModelParameters& model);

  /// Sets gravity (eq. 12) and momentum. To be called after the elements are added.
  void add_loads(Eigen::Index rows, double tip_mass_kg);

  ElementCoordinates coordinates_of(const Element& element, const Coordinates& q) const {
    return q(Eigen::all, element.row);
  }
  const ElementConstants<double>& constants_of(const Element& element) const {
    return constants_[element.link];
  }
  double length_of(const Element& element) const {
    return 1.0 / constants_of(element).inverse_length;
  }

  Eigen::Index rows_ = 0;
  double gravity_m_s2_;
  double mass_per_length_;
  double mass_kg_;
  std::vector<ElementConstants<double>> constants_;  ///< by link
  std::vector<Element> elements_;
  Eigen::VectorXd weight_N_;     ///< generalised gravity along y [N] and [N m], by row
  Eigen::VectorXd momentum_kg_;  ///< momentum per rate [kg] and [kg m], by row
};

/// The chain with joints eliminated (eq. 13): two links share the position of their joint, and each
/// has its own slope there. Immutable.
///
/// Rows along the chain: the pin's position (row 0, held at zero), its slope, then position and
/// slope of each node; at a joint the slope of the inner link, the position, the slope of the outer
/// link. Each element has four consecutive rows, so all matrices have half-bandwidth 3.
class Chain : public ElementChain {
 public:
  /// Throws InputError when `model` is outside its domain.
  explicit Chain(const ModelParameters& model);

  ChainTables<double> tables() const;
  template <class Real>
  void accelerations(const Real* q, const Real& ft_N, const Real& fn_N, Real* acceleration) const {
    chain_accelerations(tables(), q, ft_N, fn_N, acceleration);
  }

  double kinetic_energy_J(const Coordinates& v) const override;
  /// Force on a link at its inner end (the pin or a joint): M q'' + dU/dq - Q of its first node.
  Eigen::Vector2d inner_end_force(std::size_t link, const Coordinates& q,
                                  const Coordinates& acceleration) const;

  /// Highest angular frequency [rad/s] of the straight chain with springs of `tip_stiffness_N_m` at
  /// the tip in both directions. Relative error 1e-10.
  double highest_frequency_rad_s(double tip_stiffness_N_m) const;

  /// Inertia of the tip against a sudden force [kg]: 1/(M^-1) at the tip, about the tip mass and a
  /// sixteenth of the last element.
  double tip_inertia_kg() const;

 private:
  std::size_t elements_per_link() const { return elements_.size() / links(); }
  double risen_eigenvalue(double tip_stiffness_N_m) const;

  double tip_mass_kg_;
  std::vector<LinkBalance<double>> balance_;
  BandedMatrix mass_;  ///< mass matrix of the free rows; row 0 is a unit row
  BandedCholesky mass_factor_;
  BandedMatrix along_;  ///< stiffness of the straight chain along itself: axial and bending
  double free_eigenvalue_ = 0.0;  ///< square of the highest frequency without springs at the tip
};

}  // namespace oblique::solver
