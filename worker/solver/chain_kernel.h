#pragma once

#include <cstddef>

#include "worker/solver/beam_element.h"

/// The innermost loops: the chain's accelerations for one number or a vector of lanes. Plain tables
/// and templates over `Real` only, so that one source serves every instruction set: nothing here
/// may call an ordinary inline function that other translation units share.
namespace oblique::solver {

/// Half-bandwidth of every matrix of the eliminated chain: an element spans four consecutive rows.
inline constexpr std::size_t kHalfBandwidth = 3;

struct ElementTable {
  std::size_t row[4];  ///< rows of p_i, s_i, p_j, s_j
  double inverse_length;
  double half_EA_length;  ///< EA l/2
  double bending;         ///< 2 EI/l
};

/// One row of A = L D Lᵀ, L with unit diagonal.
struct FactorRow {
  double factor[kHalfBandwidth];  ///< L(i, i-1), L(i, i-2), L(i, i-3); zero beyond the matrix
  double inverse_pivot;
};

/// What the loops read. Points into a Chain, which must outlive it.
struct ChainTables {
  std::size_t rows;
  std::size_t tip_row;
  std::size_t elements;
  const ElementTable* element;
  const FactorRow* mass_factor;
  const double* gravity;
};

/// Solves A z = f in place for two right-hand sides interleaved by rows: f[2 i + c]. Needs
/// n >= kHalfBandwidth.
template <class Real>
inline void solve_factored(const FactorRow* row, std::size_t n, Real* f) {
  const auto eliminate = [&](std::size_t i, std::size_t reach) {
    Real x = f[2 * i];
    Real y = f[2 * i + 1];
    for (std::size_t d = 1; d <= reach; ++d) {
      x -= row[i].factor[d - 1] * f[2 * (i - d)];
      y -= row[i].factor[d - 1] * f[2 * (i - d) + 1];
    }
    f[2 * i] = x;
    f[2 * i + 1] = y;
  };
  eliminate(1, 1);
  eliminate(2, 2);
  for (std::size_t i = kHalfBandwidth; i < n; ++i) {
    eliminate(i, kHalfBandwidth);
  }
  const auto substitute = [&](std::size_t i, std::size_t reach) {
    Real x = f[2 * i] * row[i].inverse_pivot;
    Real y = f[2 * i + 1] * row[i].inverse_pivot;
    for (std::size_t d = reach; d >= 1; --d) {
      x -= row[i + d].factor[d - 1] * f[2 * (i + d)];
      y -= row[i + d].factor[d - 1] * f[2 * (i + d) + 1];
    }
    f[2 * i] = x;
    f[2 * i + 1] = y;
  };
  substitute(n - 1, 0);
  substitute(n - 2, 1);
  substitute(n - 3, 2);
  for (std::size_t i = n - kHalfBandwidth; i-- > 0;) {
    substitute(i, kHalfBandwidth);
  }
}

/// force -= dU/dq. `q` and `force` have 2 rows entries.
template <class Real>
inline void subtract_elastic_force(const ChainTables& chain, const Real* q, Real* force) {
  for (std::size_t e = 0; e < chain.elements; ++e) {
    const ElementTable& element = chain.element[e];
    const std::size_t pi = 2 * element.row[0];
    const std::size_t si = 2 * element.row[1];
    const std::size_t pj = 2 * element.row[2];
    const std::size_t sj = 2 * element.row[3];
    const GradientCoefficients<Real> g = gradient_coefficients(
        PlanarVector<Real>{q[pi], q[pi + 1]}, PlanarVector<Real>{q[si], q[si + 1]},
        PlanarVector<Real>{q[pj], q[pj + 1]}, PlanarVector<Real>{q[sj], q[sj + 1]},
        element.inverse_length);
    const GradientCoefficients<Real> f =
        elastic_gradient(g, element.half_EA_length, element.bending);
    // c0 = (p_j - p_i)/l, c1 = (s_j - s_i)/2, c2 = (s_i + s_j)/2 - c0.
    const Real px = (f.c[0].x - f.c[2].x) * element.inverse_length;
    const Real py = (f.c[0].y - f.c[2].y) * element.inverse_length;
    force[pi] += px;
    force[pi + 1] += py;
    force[pj] -= px;
    force[pj + 1] -= py;
    force[si] -= 0.5 * (f.c[2].x - f.c[1].x);
    force[si + 1] -= 0.5 * (f.c[2].y - f.c[1].y);
    force[sj] -= 0.5 * (f.c[2].x + f.c[1].x);
    force[sj + 1] -= 0.5 * (f.c[2].y + f.c[1].y);
  }
}

/// q'' = M^-1 (Q_gravity + S_tipᵀ F - dU/dq). `q` and `acceleration` have 2 rows entries.
template <class Real>
inline void chain_accelerations(const ChainTables& chain, const Real* q, const Real& ft_N,
                                const Real& fn_N, Real* acceleration) {
  for (std::size_t i = 0; i < 2 * chain.rows; ++i) {
    acceleration[i] = Real{} + chain.gravity[i];
  }
  acceleration[2 * chain.tip_row] += ft_N;
  acceleration[2 * chain.tip_row + 1] += fn_N;
  subtract_elastic_force(chain, q, acceleration);
  acceleration[0] = Real{};  // the pin does not move
  acceleration[1] = Real{};
  solve_factored(chain.mass_factor, chain.rows, acceleration);
}

}  // namespace oblique::solver
