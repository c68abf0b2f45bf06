#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "worker/solver/chain/banded_cholesky.h"
#include "worker/solver/chain/banded_lu.h"
#include "worker/solver/chain/beam_element.h"
#include "worker/solver/chain/tip_state.h"
#include "worker/solver/model/parameters.h"

namespace oblique::solver {

/// Positions and slopes of a chain, or their rates: one a column, x above y.
using Coordinates = Eigen::Matrix2Xd;

/// Room for what a step computes on its way, so that steps allocate nothing. No part of a state: a
/// copy has none of it, and who is assigned to keeps his own.
struct StepRoom {
  StepRoom() = default;
  StepRoom(const StepRoom&) {}
  StepRoom(StepRoom&&) noexcept = default;
  StepRoom& operator=(const StepRoom&) { return *this; }
  StepRoom& operator=(StepRoom&&) noexcept = default;
  ~StepRoom() = default;

  Coordinates vectors;
  BandedLu<7> matrix;  ///< of ConstrainedChain
};

struct ChainState {
  double t_s = 0.0;  ///< since release
  Coordinates q;     ///< [m] and [-]
  Coordinates v;     ///< [m/s] and [1/s]
  /// What an integrator remembers besides; empty where it remembers nothing.
  Coordinates acceleration;  ///< q'' at t_s
  /// (a - q'')/h of generalized-alpha: a_n stands for q'' a fixed part of a step away, so it is
  /// kept per second and serves a next step of any length.
  Coordinates algorithmic_offset_rate;
  Coordinates multipliers_N;     ///< a column a link
  bool has_offset_rate = false;  ///< false after a restart: the next step finds it
  StepRoom room = {};
};

/// The chain with joints eliminated: links share the position of a joint and keep slopes of their
/// own. Immutable; what changes is ChainState.
///
/// Rows run along the chain so that each element owns four consecutive ones: the pin's position
/// (row 0, held at zero), its slope, then position and slope of each node; at a joint the slope of
/// the inner link, the position, the slope of the outer link. All matrices then have half-bandwidth
/// 3. Both directions share one scalar matrix.
class Chain {
 public:
  /// Throws InputError when `model` is outside its domain.
  explicit Chain(const ModelParameters& model);

  /// Of the matrices, and columns of Coordinates.
  Eigen::Index rows() const { return rows_; }
  Eigen::Index tip_row() const { return rows_ - 2; }
  double gravity_m_s2() const { return gravity_m_s2_; }

  /// Straight, horizontal, unstressed, at rest (paper, section 2).
  ChainState at_rest() const;

  /// The tables that the kernels of chain_kernel.h read.
  ChainTables<double> tables() const {
    return {static_cast<std::size_t>(rows_),
            static_cast<std::size_t>(tip_row()),
            links(),
            elements_.size() / links(),
            constants_.data(),
            mass_factor_.data(),
            weight_N_.data(),
            momentum_kg_.data(),
            balance_.data()};
  }
  /// As in chain_kernel.h.
  template <class Real>
  void accelerations(const Real* q, const Real& ft_N, const Real& fn_N, Real* acceleration) const {
    chain_accelerations(tables(), q, ft_N, fn_N, acceleration);
  }

  double kinetic_energy_J(const Coordinates& v) const;
  double strain_energy_J(const Coordinates& q) const;
  double gravity_energy_J(const Coordinates& q) const;
  TipState tip(const ChainState& state) const;
  Eigen::Vector2d momentum_Ns(const Coordinates& v) const;
  /// O first, then the outer end of each element.
  Coordinates node_positions_m(const Coordinates& q) const;

  std::size_t links() const { return first_element_.size(); }
  /// Force on a link at its inner end (the pin or a joint), from the balance of its first node:
  /// M q'' + dU/dq - Q there.
  Eigen::Vector2d inner_end_force(std::size_t link, const Coordinates& q,
                                  const Coordinates& acceleration) const;

  /// Highest angular frequency [rad/s] of the straight chain, the tip held by springs of
  /// `tip_stiffness_N_m` in both directions. To a relative 1e-10.
  double highest_frequency_rad_s(double tip_stiffness_N_m) const;

  /// Mass that the tip shows to a sudden force across or along the chain [kg]: 1/(M^-1) at the tip,
  /// tip_mass and about a sixteenth of the last element.
  double tip_inertia_kg() const;

 private:
  struct Element {
    std::array<Eigen::Index, 4> row;  ///< of p_i, s_i, p_j, s_j
    double inverse_length;
    double half_EA_length;  ///< EA l/2
    double bending;         ///< 2 EI/l
  };
  static GradientCoefficients gradient(const Element& element, const Coordinates& q);
  void number_rows(const ModelParameters& model);
  void balance_links(double tip_mass_kg);
  double risen_eigenvalue(double tip_stiffness_N_m) const;

  Eigen::Index rows_;
  double gravity_m_s2_;
  double mass_per_length_;
  std::vector<Element> elements_;
  std::vector<std::size_t> first_element_;           ///< of each link
  std::vector<ElasticConstants<double>> constants_;  ///< of an element of each link
  Eigen::VectorXd weight_N_;     ///< generalised gravity along y [N] and [N m], one a row
  Eigen::VectorXd momentum_kg_;  ///< what a rate adds to the momentum [kg] and [kg m]
  std::vector<LinkBalance<double>> balance_;
  BandedMatrix mass_;  ///< of the free rows; row 0 is a unit row
  BandedCholesky mass_factor_;
  BandedMatrix along_;  ///< stiffness of the straight chain along itself: axial and bending
  double free_eigenvalue_ = 0.0;  ///< square of the highest frequency without springs
};

}  // namespace oblique::solver
