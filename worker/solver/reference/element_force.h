#pragma once

/// The elastic force of the beam element and its derivatives: one source for numbers, for packs of
/// lanes and, as `Constant`, for constants that all lanes share or each lane has for itself.
/// Without Eigen, and without any function that other translation units share: kernels are compiled
/// once for each instruction set.
namespace oblique::solver {

/// c + a b. Multiply-adds are called by name, so that which operations round once is written here
/// and not left to a compiler, whose choice may differ from one instance of a template to the next.
/// For numbers it is what the compiler makes of it; packs have their own in lane_pack.h.
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

/// What forces, tangent and mass of an element need; all elements of a link have one.
template <class Constant>
struct ElementConstants {
  // Of elastic_forces().
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
  Constant m_pp;     ///< mass matrix (eq. 6): p_i with itself; so on, s_j and p_j by symmetry
  Constant m_ps;     ///< p_i with s_i, -(p_j with s_j)
  Constant m_ss;
  Constant n_pp;  ///< p_i with p_j
  Constant n_ps;  ///< s_i with p_j, -(p_i with s_j)
  Constant n_ss;  ///< -(s_i with s_j)
};

/// What one element's strain energy U does: -dU/dq is pull on p_i, -pull on p_j, by_d - by_t on s_i
/// and -by_d - by_t on s_j.
template <class Real>
struct ElasticForces {
  PlanarVector<Real> pull;
  PlanarVector<Real> by_d;  ///< dU/dd
  PlanarVector<Real> by_t;  ///< dU/dt
};

/// The force K q of eqs. 9 to 11, as corrected: dU/dq of U (eq. 7) in closed form.
///
/// With S = EA l and eps = sum E_k P_k, dU/dc_a = S sum_b K_ab c_b + bending, where
/// K_ab = 1/2 int eps P_a P_b dzeta over [-1, 1] (beam_element.h has the notation). The product
/// rules of Legendre polynomials give
///   E_0 = (c0.c0 + c1.c1/3 + c2.c2/5 - 1)/2,  E_1 = c0.c1 + 2/5 c1.c2,
///   E_2 = c0.c2 + c1.c1/3 + c2.c2/7,          E_3 = 3/5 c1.c2,  E_4 = 9/35 c2.c2,
///   K_00 = E_0,  K_01 = E_1/3,  K_02 = E_2/5,  K_11 = (E_0 + 2/5 E_2)/3,
///   K_12 = 2/15 E_1 + 3/35 E_3,  K_22 = E_0/5 + 2/35 E_2 + 2/35 E_4.
/// Scaled coordinates u = p_j - p_i = l c0, d = s_j - s_i = 2 c1 and t = 2 c2 leave the constants
/// to a table.
template <class Real, class Constant>
inline ElasticForces<Real> elastic_forces(const PlanarVector<Real>& p_i,
                                          const PlanarVector<Real>& s_i,
                                          const PlanarVector<Real>& p_j,
                                          const PlanarVector<Real>& s_j,
                                          const ElementConstants<Constant>& k) {
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

template <class Real>
struct SymmetricPair {
  Real xx;
  Real xy;
  Real yy;
};

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

namespace tangent_detail {

using Gauss = GaussRule;
inline constexpr double kOuterP2 = legendre_p2(Gauss::outer);
inline constexpr double kInnerP2 = legendre_p2(Gauss::inner);

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

/// a A + b B.
template <class Real>
inline SymmetricPair<Real> sum(double a, const SymmetricPair<Real>& A, double b,
                               const SymmetricPair<Real>& B) {
  return {plus_product(b * B.xx, a, A.xx), plus_product(b * B.xy, a, A.xy),
          plus_product(b * B.yy, a, A.yy)};
}

/// C + c D + (tr(C + c D)/2 + more) I.
template <class Real>
inline SymmetricPair<Real> with_trace(const SymmetricPair<Real>& C, double c,
                                      const SymmetricPair<Real>& D, const Real& more) {
  const Real xx = plus_product(C.xx, c, D.xx);
  const Real yy = plus_product(C.yy, c, D.yy);
  const Real trace = plus_product(more, 0.5, xx + yy);
  return {xx + trace, plus_product(C.xy, c, D.xy), yy + trace};
}

/// Tangent in the coefficients of the gradient.
template <class Real>
struct GradientTangent {
  SymmetricPair<Real> c00;
  SymmetricPair<Real> c01;
  SymmetricPair<Real> c02;
  SymmetricPair<Real> c11;
  SymmetricPair<Real> c12;
  SymmetricPair<Real> c22;
};

template <class Real, class Constant>
inline GradientTangent<Real> gradient_tangent(const PlanarVector<Real>& c0,
                                              const PlanarVector<Real>& c1,
                                              const PlanarVector<Real>& c2,
                                              const ElementConstants<Constant>& k) {
  using Vector = PlanarVector<Real>;
  // r' = even +- odd at +-zeta.
  const Vector outer_even = plus_product(c0, kOuterP2, c2);
  const Vector inner_even = plus_product(c0, kInnerP2, c2);
  const Vector centre = less_product(c0, 0.5, c2);
  const Vector outer_odd = Gauss::outer * c1;
  const Vector inner_odd = Gauss::inner * c1;
  const Real outer = Gauss::outer_weight * k.axial;
  const Real inner = Gauss::inner_weight * k.axial;
  const SymmetricPair<Real> Mo = squares(outer, outer_even, outer_odd);
  const SymmetricPair<Real> Mi = squares(inner, inner_even, inner_odd);
  const SymmetricPair<Real> Mc = squares(0.25 * Gauss::centre_weight * k.axial, centre, centre);
  const SymmetricPair<Real> Oo = mixed(outer, outer_even, outer_odd);
  const SymmetricPair<Real> Oi = mixed(inner, inner_even, inner_odd);
  const Real none = k.axial - k.axial;
  return {with_trace(sum(1.0, Mo, 1.0, Mi), 1.0, Mc, -0.5 * k.axial),
          with_trace(sum(Gauss::outer, Oo, Gauss::inner, Oi), 0.0, Mc, none),
          with_trace(sum(kOuterP2, Mo, kInnerP2, Mi), -0.5, Mc, none),
          with_trace(sum(Gauss::outer * Gauss::outer, Mo, Gauss::inner * Gauss::inner, Mi), 0.0, Mc,
                     2.0 * k.bending - (1.0 / 6.0) * k.axial),
          with_trace(sum(Gauss::outer * kOuterP2, Oo, Gauss::inner * kInnerP2, Oi), 0.0, Mc, none),
          with_trace(sum(kOuterP2 * kOuterP2, Mo, kInnerP2 * kInnerP2, Mi), 0.25, Mc,
                     6.0 * k.bending - 0.1 * k.axial)};
}

/// The blocks' entries of one kind (xx, xy or yy) from those of the gradient's tangent: with
/// dc0 = (dp_j - dp_i)/l, dc1 = (ds_j - ds_i)/2, dc2 = (ds_i + ds_j)/2 - dc0.
template <class Real, class Constant>
inline void put_entries(const GradientTangent<Real>& g, const Constant& inverse_length,
                        Real SymmetricPair<Real>::*entry, TangentBlocks<Real>& blocks) {
  const Real c12 = g.c12.*entry;
  const Real along = g.c01.*entry - c12;
  const Real across = g.c02.*entry - g.c22.*entry;
  const Real half = 0.5 * inverse_length;
  blocks.pp.*entry = inverse_length * inverse_length * ((g.c00.*entry - g.c02.*entry) - across);
  blocks.ps_i.*entry = half * (along - across);
  blocks.ps_j.*entry = (0.0 - half) * (along + across);
  const Real ends = 0.25 * (g.c11.*entry + g.c22.*entry);
  blocks.ss_ii.*entry = less_product(ends, 0.5, c12);
  blocks.ss_jj.*entry = plus_product(ends, 0.5, c12);
  blocks.ss_ij.*entry = 0.25 * (g.c22.*entry - g.c11.*entry);
}

}  // namespace tangent_detail

/// The derivative of elastic_forces(): with coefficients c_a of the gradient and S = EA l,
///
///   d2U/dc_a dc_b = G_ab + (tr G_ab - S/2 int P_a P_b dzeta)/2 I + bending,
///   G_ab = S/2 int P_a P_b r' r'T dzeta over [-1, 1],
///
/// by five Gauss points, which are exact.
template <class Real, class Constant>
inline TangentBlocks<Real> element_tangent(const PlanarVector<Real>& p_i,
                                           const PlanarVector<Real>& s_i,
                                           const PlanarVector<Real>& p_j,
                                           const PlanarVector<Real>& s_j,
                                           const ElementConstants<Constant>& k) {
  const PlanarVector<Real> c0 = k.inverse_length * (p_j - p_i);
  const PlanarVector<Real> c1 = 0.5 * (s_j - s_i);
  const PlanarVector<Real> c2 = 0.5 * (s_i + s_j) - c0;
  const tangent_detail::GradientTangent<Real> g = tangent_detail::gradient_tangent(c0, c1, c2, k);
  TangentBlocks<Real> blocks;
  tangent_detail::put_entries(g, k.inverse_length, &SymmetricPair<Real>::xx, blocks);
  tangent_detail::put_entries(g, k.inverse_length, &SymmetricPair<Real>::xy, blocks);
  tangent_detail::put_entries(g, k.inverse_length, &SymmetricPair<Real>::yy, blocks);
  return blocks;
}

}  // namespace oblique::solver
