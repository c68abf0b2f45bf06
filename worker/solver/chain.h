#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "worker/solver/banded_cholesky.h"
#include "worker/solver/beam_element.h"
#include "worker/solver/parameters.h"

namespace oblique::solver {

/// Positions and slopes of a chain, or their rates. `values[2 row + c]`, c = 0 for x, 1 for y.
using Coordinates = std::vector<double>;

struct ChainState {
  double t_s = 0.0;  ///< since release
  Coordinates q;     ///< [m] and [-]
  Coordinates v;     ///< [m/s] and [1/s]
  /// What an integrator remembers besides; empty where it remembers nothing.
  Coordinates acceleration;  ///< q'' at t_s
  /// (a - q'')/h of generalized-alpha: a_n stands for q'' a fixed part of a step away, so it is
  /// kept per second and serves a next step of any length.
  Coordinates algorithmic_offset_rate;
  std::vector<double> multipliers_N;  ///< joint multipliers, x and y in turn
};

/// Tip position and velocity in the fixed frame, origin at O, y up.
struct TipState {
  double x_m;
  double y_m;
  double vx_m_s;
  double vy_m_s;
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

  std::size_t rows() const { return rows_; }
  std::size_t tip_row() const { return rows_ - 2; }
  double gravity_m_s2() const { return gravity_m_s2_; }

  /// Straight, horizontal, unstressed, at rest (paper, section 2).
  ChainState at_rest() const;

  /// q'' = M^-1 (Q_gravity + S_tipᵀ F - dU/dq). `q` and `acceleration` have 2 rows() entries.
  /// `Real` is a number or a vector of lanes.
  template <class Real>
  void accelerations(const Real* q, const Real& ft_N, const Real& fn_N, Real* acceleration) const;

  /// dU/dq, added to `force` with factor -1.
  template <class Real>
  void subtract_elastic_force(const Real* q, Real* force) const;

  double kinetic_energy_J(const Coordinates& v) const;
  double strain_energy_J(const Coordinates& q) const;
  double gravity_energy_J(const Coordinates& q) const;
  TipState tip(const ChainState& state) const;

  std::size_t links() const { return first_element_.size(); }
  /// Force on a link at its inner end (the pin or a joint), from the balance of its first node:
  /// M q'' + dU/dq - Q there.
  PlanarVector<double> inner_end_force(std::size_t link, const Coordinates& q,
                                       const Coordinates& acceleration) const;

  /// Highest angular frequency [rad/s] of the straight chain, the tip held by springs of
  /// `tip_stiffness_N_m` in both directions. To a relative 1e-10.
  double highest_frequency_rad_s(double tip_stiffness_N_m) const;

 private:
  struct Element {
    std::array<std::size_t, 4> row;  ///< rows of p_i, s_i, p_j, s_j
    double inverse_length;
    double half_EA_length;  ///< EA l/2
    double bending;         ///< 2 EI/l
  };
  void number_rows(const ModelParameters& model);

  std::size_t rows_;
  double gravity_m_s2_;
  double mass_per_length_;
  std::vector<Element> elements_;
  std::vector<std::size_t> first_element_;  ///< of each link
  Coordinates gravity_;                     ///< generalised force [N] and [N m]
  BandedMatrix mass_;                       ///< of the free rows; row 0 is a unit row
  BandedCholesky mass_factor_;
  BandedMatrix along_;  ///< stiffness of the straight chain along itself: axial and bending
};

template <class Real>
void Chain::subtract_elastic_force(const Real* q, Real* force) const {
  const auto at = [q](std::size_t row) { return PlanarVector<Real>{q[2 * row], q[2 * row + 1]}; };
  for (const Element& element : elements_) {
    const auto [pi, si, pj, sj] = element.row;
    const auto g = gradient_coefficients(at(pi), at(si), at(pj), at(sj), element.inverse_length);
    const auto f = elastic_gradient(g, element.half_EA_length, element.bending);
    // c0 = (p_j - p_i)/l, c1 = (s_j - s_i)/2, c2 = (s_i + s_j)/2 - c0.
    const Real px = (f.c[0].x - f.c[2].x) * element.inverse_length;
    const Real py = (f.c[0].y - f.c[2].y) * element.inverse_length;
    force[2 * pi] += px;
    force[2 * pi + 1] += py;
    force[2 * pj] -= px;
    force[2 * pj + 1] -= py;
    force[2 * si] -= 0.5 * (f.c[2].x - f.c[1].x);
    force[2 * si + 1] -= 0.5 * (f.c[2].y - f.c[1].y);
    force[2 * sj] -= 0.5 * (f.c[2].x + f.c[1].x);
    force[2 * sj + 1] -= 0.5 * (f.c[2].y + f.c[1].y);
  }
}

template <class Real>
void Chain::accelerations(const Real* q, const Real& ft_N, const Real& fn_N,
                          Real* acceleration) const {
  for (std::size_t i = 0; i < 2 * rows_; ++i) {
    acceleration[i] = Real{} + gravity_[i];
  }
  acceleration[2 * tip_row()] += ft_N;
  acceleration[2 * tip_row() + 1] += fn_N;
  subtract_elastic_force(q, acceleration);
  acceleration[0] = Real{};  // the pin does not move
  acceleration[1] = Real{};
  mass_factor_.solve_pairs(acceleration);
}

}  // namespace oblique::solver
