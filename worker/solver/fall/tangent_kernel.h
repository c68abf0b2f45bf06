#pragma once

#include "worker/solver/chain/planar_vector.h"

/// Second derivatives of an element's strain energy for packs of lanes: those of beam_tangent.h in
/// closed form. With coefficients c_a of the gradient (beam_element.h) and S = EA l,
///
///   d2U/dc_a dc_b = G_ab + (tr G_ab - S/2 int P_a P_b dzeta)/2 I + bending,
///   G_ab = S/2 int P_a P_b r' r'T dzeta over [-1, 1],
///
/// by five Gauss points, which are exact. Every block is a symmetric 2x2 matrix, since r' r'T is.
namespace oblique::solver {

template <class Real>
struct SymmetricPair {
  Real xx;
  Real xy;
  Real yy;
};

/// What the tangent and the mass matrix of an element ask for; all elements of a link have one.
template <class Constant>
struct ElementConstants {
  Constant inverse_length;
  Constant axial;    ///< EA l [N m]
  Constant bending;  ///< 2 EI/l [N m]
  Constant m_pp;     ///< mass matrix: p_i with itself; so on, s_j and p_j by symmetry
  Constant m_ps;     ///< p_i with s_i, -(p_j with s_j)
  Constant m_ss;
  Constant n_pp;  ///< p_i with p_j
  Constant n_ps;  ///< s_i with p_j, -(p_i with s_j)
  Constant n_ss;  ///< -(s_i with s_j)
};

/// The blocks that differ: p_j p_j is pp, p_i p_j is -pp, p_j s_i is -ps_i, p_j s_j is -ps_j.
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

inline constexpr double kOuter = 0.90617984593866399280;
inline constexpr double kInner = 0.53846931010568309104;
inline constexpr double kOuterWeight = 0.23692688505618908751;
inline constexpr double kInnerWeight = 0.47862867049936646804;
inline constexpr double kCentreWeight = 0.56888888888888888889;
inline constexpr double kOuterP2 = 1.5 * kOuter * kOuter - 0.5;
inline constexpr double kInnerP2 = 1.5 * kInner * kInner - 0.5;

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
  const Vector outer_odd = kOuter * c1;
  const Vector inner_odd = kInner * c1;
  const Real outer = kOuterWeight * k.axial;
  const Real inner = kInnerWeight * k.axial;
  const SymmetricPair<Real> Mo = squares(outer, outer_even, outer_odd);
  const SymmetricPair<Real> Mi = squares(inner, inner_even, inner_odd);
  const SymmetricPair<Real> Mc = squares(0.25 * kCentreWeight * k.axial, centre, centre);
  const SymmetricPair<Real> Oo = mixed(outer, outer_even, outer_odd);
  const SymmetricPair<Real> Oi = mixed(inner, inner_even, inner_odd);
  const Real none = k.axial - k.axial;
  return {with_trace(sum(1.0, Mo, 1.0, Mi), 1.0, Mc, -0.5 * k.axial),
          with_trace(sum(kOuter, Oo, kInner, Oi), 0.0, Mc, none),
          with_trace(sum(kOuterP2, Mo, kInnerP2, Mi), -0.5, Mc, none),
          with_trace(sum(kOuter * kOuter, Mo, kInner * kInner, Mi), 0.0, Mc,
                     2.0 * k.bending - (1.0 / 6.0) * k.axial),
          with_trace(sum(kOuter * kOuterP2, Oo, kInner * kInnerP2, Oi), 0.0, Mc, none),
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
