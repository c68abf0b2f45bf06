#pragma once

#include "worker/solver/chain/planar_vector.h"

/// Elastic forces of the beam element in closed form, for the innermost loops.
///
/// With S = EA l and eps = sum E_k P_k, dU/dc_a = S sum_b K_ab c_b, K_ab = 1/2 int eps P_a P_b
/// dzeta over [-1, 1] (beam_element.h has the notation). The product rules of Legendre polynomials
/// give
///   E_0 = (c0.c0 + c1.c1/3 + c2.c2/5 - 1)/2,  E_1 = c0.c1 + 2/5 c1.c2,
///   E_2 = c0.c2 + c1.c1/3 + c2.c2/7,          E_3 = 3/5 c1.c2,  E_4 = 9/35 c2.c2,
///   K_00 = E_0,  K_01 = E_1/3,  K_02 = E_2/5,  K_11 = (E_0 + 2/5 E_2)/3,
///   K_12 = 2/15 E_1 + 3/35 E_3,  K_22 = E_0/5 + 2/35 E_2 + 2/35 E_4.
/// Five Gauss points give the same, being exact for these integrands, at half as much work again.
/// Scaled coordinates u = p_j - p_i = l c0, d = s_j - s_i = 2 c1 and t = 2 c2 leave the constants
/// to a table.
namespace oblique::solver {

/// Of one element length. `Constant` is a number, or a pack where each lane has its own.
template <class Constant>
struct ElasticConstants {
  Constant two_inverse_length;
  Constant k00, k00_uu, k00_dd, k00_tt;
  Constant k01_ud, k01_dt;
  Constant k02_ut, k02_dd, k02_tt;
  Constant k11, k11_k00, k11_k02;
  Constant k12_k01, k12_dt;
  Constant k22, k22_k00, k22_k02, k22_tt;
};

/// half_EA_length = EA l/2 [N m]; bending = 2 EI/l [N m].
ElasticConstants<double> elastic_constants(double length_m, double half_EA_length, double bending);

/// What one element's strain energy U does: -dU/dq is pull on p_i, -pull on p_j, by_d - by_t on s_i
/// and -by_d - by_t on s_j.
template <class Real>
struct ElasticForces {
  PlanarVector<Real> pull;
  PlanarVector<Real> by_d;  ///< dU/dd
  PlanarVector<Real> by_t;  ///< dU/dt
};

template <class Real, class Constant>
inline ElasticForces<Real> elastic_forces(const PlanarVector<Real>& p_i,
                                          const PlanarVector<Real>& s_i,
                                          const PlanarVector<Real>& p_j,
                                          const PlanarVector<Real>& s_j,
                                          const ElasticConstants<Constant>& k) {
  // By components, not pairs, which compilers copy through memory.
  using Vector = PlanarVector<Real>;
  const Vector u{p_j.x - p_i.x, p_j.y - p_i.y};
  const Vector d{s_j.x - s_i.x, s_j.y - s_i.y};
  const Vector t{less_product(s_i.x + s_j.x, k.two_inverse_length, u.x),
                 less_product(s_i.y + s_j.y, k.two_inverse_length, u.y)};
  const Real dd = dot(d, d);
  const Real tt = dot(t, t);
  const Real dt = dot(d, t);
  Real k00 = plus_product(k.k00, k.k00_uu, dot(u, u));
  k00 = plus_product(plus_product(k00, k.k00_dd, dd), k.k00_tt, tt);
  const Real k01 = plus_product(k.k01_ud * dot(u, d), k.k01_dt, dt);
  const Real k02 = plus_product(plus_product(k.k02_ut * dot(u, t), k.k02_dd, dd), k.k02_tt, tt);
  const Real k11 = plus_product(plus_product(k.k11, k.k11_k00, k00), k.k11_k02, k02);
  const Real k12 = plus_product(k.k12_k01 * k01, k.k12_dt, dt);
  Real k22 = plus_product(k.k22, k.k22_tt, tt);
  k22 = plus_product(plus_product(k22, k.k22_k00, k00), k.k22_k02, k02);
  const auto times = [](const Real& a, const Real& b, const Real& c, const Real& of_u,
                        const Real& of_d, const Real& of_t) {
    return plus_product(plus_product(a * of_u, b, of_d), c, of_t);
  };
  const Vector by_d{times(k01, k11, k12, u.x, d.x, t.x), times(k01, k11, k12, u.y, d.y, t.y)};
  const Vector by_t{times(k02, k12, k22, u.x, d.x, t.x), times(k02, k12, k22, u.y, d.y, t.y)};
  return {{less_product(times(k00, k01, k02, u.x, d.x, t.x), k.two_inverse_length, by_t.x),
           less_product(times(k00, k01, k02, u.y, d.y, t.y), k.two_inverse_length, by_t.y)},
          {by_d.x, by_d.y},
          {by_t.x, by_t.y}};
}

}  // namespace oblique::solver
