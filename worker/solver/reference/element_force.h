#pragma once

/// The elastic force of the beam element and its tangent, for numbers and packs of lanes (`Real`)
/// with shared or different constants (`Constant`). Kernels are compiled once for each instruction
/// set, so nothing here is shared with other translation units.
namespace oblique::solver {

/// c + a b. Multiply-adds are explicit, because compilers would fuse different ones in each
/// instance of a template. fast/kernel_of.h has fused ones for packs.
template <class C, class A, class B>
inline auto plus_product(const C& c, const A& a, const B& b) {
  return c + a * b;
}

/// c - a b.
template <class C, class A, class B>
inline auto less_product(const C& c, const A& a, const B& b) {
  return c - a * b;
}

template <class Real>
struct PlanarVector {
  Real x;
  Real y;

  friend inline PlanarVector operator+(const PlanarVector& a, const PlanarVector& b) {
    return {a.x + b.x, a.y + b.y};
  }
  friend inline PlanarVector operator-(const PlanarVector& a, const PlanarVector& b) {
    return {a.x - b.x, a.y - b.y};
  }
  template <class Constant>
  friend inline PlanarVector operator*(const Constant& a, const PlanarVector& b) {
    return {a * b.x, a * b.y};
  }
};

template <class Real>
inline Real dot(const PlanarVector<Real>& a, const PlanarVector<Real>& b) {
  return plus_product(a.x * b.x, a.y, b.y);
}

template <class Real, class Constant>
inline PlanarVector<Real> plus_product(const PlanarVector<Real>& c, const Constant& a,
                                       const PlanarVector<Real>& b) {
  return {plus_product(c.x, a, b.x), plus_product(c.y, a, b.y)};
}

template <class Real, class Constant>
inline PlanarVector<Real> less_product(const PlanarVector<Real>& c, const Constant& a,
                                       const PlanarVector<Real>& b) {
  return {less_product(c.x, a, b.x), less_product(c.y, a, b.y)};
}

/// Five-point Gauss rule on [-1, 1]; exact to degree 9, and eps r' P2 has degree 8.
struct GaussRule {
  static constexpr double outer = 0.90617984593866399280;  ///< abscissa
  static constexpr double inner = 0.53846931010568309104;
  static constexpr double outer_weight = 0.23692688505618908751;
  static constexpr double inner_weight = 0.47862867049936646804;
  static constexpr double centre_weight = 0.56888888888888888889;
};

constexpr double legendre_p2(double zeta) {
  return 1.5 * zeta * zeta - 0.5;
}

/// Constants of the force, tangent and mass of all elements of a link.
template <class Constant>
struct ElementConstants {
  // For elastic_forces().
  Constant two_inverse_length;
  Constant k00, k00_uu, k00_dd, k00_tt;
  Constant k01_ud, k01_dt;
  Constant k02_ut, k02_dd, k02_tt;
  Constant k11, k11_k00, k11_k02;
  Constant k12_k01, k12_dt;
  Constant k22, k22_k00, k22_k02, k22_tt;
  Constant inverse_length;
  Constant axial;    ///< EA l [N m]
  Constant bending;  ///< 2 EI/l [N m]
  // Entries of the mass matrix M (eq. 6), by position p and slope s of the nodes i and j.
  Constant m_pp;  ///< M(p_i, p_i) = M(p_j, p_j)
  Constant m_ps;  ///< M(p_i, s_i) = -M(p_j, s_j)
  Constant m_ss;  ///< M(s_i, s_i) = M(s_j, s_j)
  Constant n_pp;  ///< M(p_i, p_j)
  Constant n_ps;  ///< M(s_i, p_j) = -M(p_i, s_j)
  Constant n_ss;  ///< -M(s_i, s_j)
};

/// Derivatives of one element's strain energy U: -dU/dq is pull on p_i, -pull on p_j, by_d - by_t
/// on s_i and -by_d - by_t on s_j.
template <class Real>
struct ElasticForces {
  PlanarVector<Real> pull;
  PlanarVector<Real> by_d;  ///< dU/dd
  PlanarVector<Real> by_t;  ///< dU/dt
};

/// The force K q of the corrected eqs. 9 to 11 (theory.md): dU/dq of U (eq. 7) in closed form.
///
/// With S = EA l and eps = sum E_k P_k, dU/dc_a = S sum_b K_ab c_b + bending, where
/// K_ab = 1/2 int eps P_a P_b dzeta over [-1, 1] (beam_element.h has the notation). The product
/// rules of Legendre polynomials give
///   E_0 = (c0.c0 + c1.c1/3 + c2.c2/5 - 1)/2,  E_1 = c0.c1 + 2/5 c1.c2,
///   E_2 = c0.c2 + c1.c1/3 + c2.c2/7,          E_3 = 3/5 c1.c2,  E_4 = 9/35 c2.c2,
///   K_00 = E_0,  K_01 = E_1/3,  K_02 = E_2/5,  K_11 = (E_0 + 2/5 E_2)/3,
///   K_12 = 2/15 E_1 + 3/35 E_3,  K_22 = E_0/5 + 2/35 E_2 + 2/35 E_4.
/// The code uses u = p_j - p_i = l c0, d = s_j - s_i = 2 c1, t = 2 c2, with factors in a table.
template <class Real, class Constant>
inline ElasticForces<Real> elastic_forces(const PlanarVector<Real>& p_i,
                                          const PlanarVector<Real>& s_i,
                                          const PlanarVector<Real>& p_j,
                                          const PlanarVector<Real>& s_j,
                                          const ElementConstants<Constant>& k) {
  // x and y are separate, because compilers copy pairs through memory.
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

/// A symmetric matrix of 2 x 2.
template <class Real>
struct SymmetricPair {
  Real xx;
  Real xy;
  Real yy;

  friend inline SymmetricPair operator+(const SymmetricPair& A, const SymmetricPair& B) {
    return {A.xx + B.xx, A.xy + B.xy, A.yy + B.yy};
  }
  friend inline SymmetricPair operator-(const SymmetricPair& A, const SymmetricPair& B) {
    return {A.xx - B.xx, A.xy - B.xy, A.yy - B.yy};
  }
  template <class Constant>
  friend inline SymmetricPair operator*(const Constant& a, const SymmetricPair& B) {
    return {a * B.xx, a * B.xy, a * B.yy};
  }
};

template <class Real>
inline SymmetricPair<Real> plus_product(const SymmetricPair<Real>& C, double a,
                                        const SymmetricPair<Real>& B) {
  return {plus_product(C.xx, a, B.xx), plus_product(C.xy, a, B.xy), plus_product(C.yy, a, B.yy)};
}

/// The blocks of d2U/dq2 that differ, each symmetric: p_j p_j is pp, p_i p_j is -pp, p_j s_i is
/// -ps_i, p_j s_j is -ps_j.
template <class Real>
struct TangentBlocks {
  SymmetricPair<Real> pp;
  SymmetricPair<Real> ps_i;
  SymmetricPair<Real> ps_j;
  SymmetricPair<Real> ss_ii;
  SymmetricPair<Real> ss_ij;
  SymmetricPair<Real> ss_jj;
};

/// f (a aT + b bT).
template <class Real>
inline SymmetricPair<Real> squares(const Real& f, const PlanarVector<Real>& a,
                                   const PlanarVector<Real>& b) {
  return {f * plus_product(a.x * a.x, b.x, b.x), f * plus_product(a.x * a.y, b.x, b.y),
          f * plus_product(a.y * a.y, b.y, b.y)};
}

/// f (a bT + b aT).
template <class Real>
inline SymmetricPair<Real> mixed(const Real& f, const PlanarVector<Real>& a,
                                 const PlanarVector<Real>& b) {
  const Real twice = f + f;
  return {twice * (a.x * b.x), f * plus_product(a.x * b.y, a.y, b.x), twice * (a.y * b.y)};
}

/// G + (tr(G)/2 + more) I.
template <class Real>
inline SymmetricPair<Real> with_trace(const SymmetricPair<Real>& G, const Real& more) {
  const Real trace = plus_product(more, 0.5, G.xx + G.yy);
  return {G.xx + trace, G.xy, G.yy + trace};
}

/// The derivative of elastic_forces(): with coefficients c_a of the gradient and S = EA l,
///
///   d2U/dc_a dc_b = G_ab + (tr G_ab - S/2 int P_a P_b dzeta)/2 I + bending,
///   G_ab = S/2 int P_a P_b r' r'T dzeta over [-1, 1],
///
/// by five Gauss points, which are exact: the centre and two pairs +-zeta, where r' = even +- odd.
/// Coordinates follow by dc0 = (dp_j - dp_i)/l, dc1 = (ds_j - ds_i)/2, dc2 = (ds_i + ds_j)/2 - dc0.
template <class Real, class Constant>
inline TangentBlocks<Real> element_tangent(const PlanarVector<Real>& p_i,
                                           const PlanarVector<Real>& s_i,
                                           const PlanarVector<Real>& p_j,
                                           const PlanarVector<Real>& s_j,
                                           const ElementConstants<Constant>& k) {
  using Vector = PlanarVector<Real>;
  using Matrix = SymmetricPair<Real>;
  constexpr double kOuter = GaussRule::outer;
  constexpr double kInner = GaussRule::inner;
  constexpr double kOuterP2 = legendre_p2(kOuter);
  constexpr double kInnerP2 = legendre_p2(kInner);
  const Vector c0 = k.inverse_length * (p_j - p_i);
  const Vector c1 = 0.5 * (s_j - s_i);
  const Vector c2 = 0.5 * (s_i + s_j) - c0;
  const Vector outer_even = plus_product(c0, kOuterP2, c2);
  const Vector inner_even = plus_product(c0, kInnerP2, c2);
  const Vector centre = less_product(c0, 0.5, c2);
  const Vector outer_odd = kOuter * c1;
  const Vector inner_odd = kInner * c1;
  const Real outer = GaussRule::outer_weight * k.axial;
  const Real inner = GaussRule::inner_weight * k.axial;
  const Matrix Mo = squares(outer, outer_even, outer_odd);
  const Matrix Mi = squares(inner, inner_even, inner_odd);
  const Matrix Mc = squares(0.25 * GaussRule::centre_weight * k.axial, centre, centre);
  const Matrix Oo = mixed(outer, outer_even, outer_odd);
  const Matrix Oi = mixed(inner, inner_even, inner_odd);
  const auto sum = [](double a, const Matrix& A, double b, const Matrix& B) {
    return plus_product(b * B, a, A);
  };
  const Real none = k.axial - k.axial;
  const Matrix g00 = with_trace(plus_product(Mo + Mi, 1.0, Mc), -0.5 * k.axial);
  const Matrix g01 = with_trace(sum(kOuter, Oo, kInner, Oi), none);
  const Matrix g02 = with_trace(plus_product(sum(kOuterP2, Mo, kInnerP2, Mi), -0.5, Mc), none);
  const Matrix g11 = with_trace(sum(kOuter * kOuter, Mo, kInner * kInner, Mi),
                                2.0 * k.bending - (1.0 / 6.0) * k.axial);
  const Matrix g12 = with_trace(sum(kOuter * kOuterP2, Oo, kInner * kInnerP2, Oi), none);
  const Matrix g22 =
      with_trace(plus_product(sum(kOuterP2 * kOuterP2, Mo, kInnerP2 * kInnerP2, Mi), 0.25, Mc),
                 6.0 * k.bending - 0.1 * k.axial);
  const Matrix along = g01 - g12;
  const Matrix across = g02 - g22;
  const Matrix ends = 0.25 * (g11 + g22);
  const Constant half = 0.5 * k.inverse_length;
  return {.pp = k.inverse_length * k.inverse_length * ((g00 - g02) - across),
          .ps_i = half * (along - across),
          .ps_j = (0.0 - half) * (along + across),
          .ss_ii = plus_product(ends, -0.5, g12),
          .ss_ij = 0.25 * (g22 - g11),
          .ss_jj = plus_product(ends, 0.5, g12)};
}

}  // namespace oblique::solver
