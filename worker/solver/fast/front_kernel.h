#pragma once

#include <cstddef>
#include <type_traits>

#include "worker/solver/fast/gauss_collocation.h"
#include "worker/solver/reference/chain_kernel.h"

/// Solves (M + z K) x = b of a whole chain for complex z, for numbers or packs of lanes, by the
/// frontal method: L D L^T without pivoting, element by element. A front contains the eight
/// unknowns of an element, both directions of p_i, s_i, p_j and s_j in the order of the rows of
/// Chain. Unknowns without a later element are eliminated; the others begin the next front.
namespace oblique::solver {

/// Kernels must not call functions of std::complex, which other files use too (README.md).
template <class Real>
struct Complex {
  Real re;
  Real im;
};

/// Complex numbers in the first `pivots` columns of a front's lower triangle.
constexpr std::size_t front_factors(std::size_t pivots) {
  return pivots * (17 - pivots) / 2;
}
/// Complex numbers in the factors of a chain's matrix: per column the inverse of D, then L.
constexpr std::size_t chain_factors(std::size_t links, std::size_t elements_per_link) {
  return links * ((elements_per_link - 1) * front_factors(4) + front_factors(6)) +
         front_factors(8) - front_factors(6);
}

namespace front_detail {

/// Number of unknowns eliminated with an element: those of its left node, at a joint also the slope
/// of the inner link, at the tip all.
template <class Constant>
inline std::size_t pivots_of(const ChainTables<Constant>& chain, std::size_t element) {
  const bool ends_link = (element + 1) % chain.elements_per_link == 0;
  const bool ends_chain = element + 1 == chain.links * chain.elements_per_link;
  return ends_chain ? 8 : ends_link ? 6 : 4;
}

/// Calls `operation` with integral constants from `first` to `last` - 1: an unrolled loop.
template <std::size_t first, std::size_t last, class Operation>
inline void for_each_place(const Operation& operation) {
  if constexpr (first < last) {
    operation(std::integral_constant<std::size_t, first>{});
    for_each_place<first + 1, last>(operation);
  }
}

template <class Real>
inline Complex<Real> product(const Complex<Real>& a, const Complex<Real>& b) {
  return {less_product(a.re * b.re, a.im, b.im), plus_product(a.re * b.im, a.im, b.re)};
}
/// c - a b.
template <class Real>
inline Complex<Real> less(const Complex<Real>& c, const Complex<Real>& a, const Complex<Real>& b) {
  return {plus_product(less_product(c.re, a.re, b.re), a.im, b.im),
          less_product(less_product(c.im, a.re, b.im), a.im, b.re)};
}
template <class Real>
inline Complex<Real> inverse(const Complex<Real>& a) {
  const Real scale = 1.0 / plus_product(a.re * a.re, a.im, a.im);
  return {a.re * scale, (0.0 - a.im) * scale};
}

/// Eliminates the unknowns first..last - 1 of a symmetric front. Reads its lower triangle.
template <std::size_t first, std::size_t last, class Real>
inline void eliminate(Complex<Real> (&front)[8][8], Complex<Real>* factors) {
  for_each_place<first, last>([&](auto pivot) {
    constexpr std::size_t k = decltype(pivot)::value;
    Complex<Real>* const column = factors + front_factors(k) - k;
    const Complex<Real> inverse_pivot = inverse(front[k][k]);
    column[k] = inverse_pivot;
    for_each_place<k + 1, 8>([&](auto below) {
      constexpr std::size_t j = decltype(below)::value;
      const Complex<Real> factor = product(front[j][k], inverse_pivot);
      for_each_place<j, 8>([&](auto row) {
        constexpr std::size_t i = decltype(row)::value;
        front[i][j] = less(front[i][j], front[i][k], factor);
      });
      column[j] = factor;
    });
  });
}

/// L y = x for the first `pivots` unknowns of a front.
template <std::size_t pivots, class Real>
inline void substitute_forward(const Complex<Real>* factors, Complex<Real> (&x)[8]) {
  for_each_place<0, pivots>([&](auto pivot) {
    constexpr std::size_t k = decltype(pivot)::value;
    for_each_place<k + 1, 8>([&](auto row) {
      constexpr std::size_t i = decltype(row)::value;
      x[i] = less(x[i], factors[front_factors(k) + i - k], x[k]);
    });
  });
}

/// D L^T x = y for the first `pivots` unknowns of a front.
template <std::size_t pivots, class Real>
inline void substitute_backward(const Complex<Real>* factors, Complex<Real> (&x)[8]) {
  for_each_place<0, pivots>([&](auto place) {
    constexpr std::size_t k = pivots - 1 - decltype(place)::value;
    Complex<Real> value = product(x[k], factors[front_factors(k)]);
    // The row solved last enters the sum last, which shortens the chain of dependent operations.
    for_each_place<0, 7 - k>([&](auto later) {
      constexpr std::size_t i = 7 - decltype(later)::value;
      value = less(value, factors[front_factors(k) + i - k], x[i]);
    });
    x[k] = value;
  });
}

/// Writes a block of M + z K at (row, column); entries above the diagonal are ignored.
template <class Real, class Constant>
inline void put_block(Complex<Real> (&front)[8][8], std::size_t row, std::size_t column,
                      const Constant& mass, const Complex<Real>& z, const SymmetricPair<Real>& K) {
  front[row][column] = {plus_product(mass, z.re, K.xx), z.im * K.xx};
  front[row + 1][column] = {z.re * K.xy, z.im * K.xy};
  front[row][column + 1] = front[row + 1][column];
  front[row + 1][column + 1] = {plus_product(mass, z.re, K.yy), z.im * K.yy};
}

/// M + z K of one element. At a joint s_j comes before p_j.
template <class Real, class Constant>
inline void put_element(Complex<Real> (&front)[8][8], bool ends_at_joint,
                        const ElementConstants<Constant>& m, const TangentBlocks<Real>& tangent,
                        const Complex<Real>& z) {
  const std::size_t p = ends_at_joint ? 6 : 4;
  const std::size_t s = ends_at_joint ? 4 : 6;
  const Complex<Real> minus_z{0.0 - z.re, 0.0 - z.im};
  put_block(front, 0, 0, m.m_pp, z, tangent.pp);
  put_block(front, 2, 0, m.m_ps, z, tangent.ps_i);
  put_block(front, 2, 2, m.m_ss, z, tangent.ss_ii);
  put_block(front, p, 0, m.n_pp, minus_z, tangent.pp);
  put_block(front, p, 2, m.n_ps, minus_z, tangent.ps_i);
  put_block(front, p, p, m.m_pp, z, tangent.pp);
  put_block(front, s, 0, 0.0 - m.n_ps, z, tangent.ps_j);
  put_block(front, s, 2, 0.0 - m.n_ss, z, tangent.ss_ij);
  put_block(front, s, s, m.m_ss, z, tangent.ss_jj);
  put_block(front, 6, 4, 0.0 - m.m_ps, minus_z, tangent.ps_j);
}

}  // namespace front_detail

/// Factors M + z K into chain_factors() numbers. `tangent` has one entry per element. Does not
/// write the columns of the pin's position, which must be zero.
template <class Real, class Constant>
inline void factor_fronts(const ChainTables<Constant>& chain, const TangentBlocks<Real>* tangent,
                          const Complex<Real>& z, Complex<Real>* factors) {
  using namespace front_detail;
  Complex<Real> carried[4][4]{};  // remaining entries of the previous front
  const std::size_t elements = chain.links * chain.elements_per_link;
  for (std::size_t element = 0; element < elements; ++element) {
    const std::size_t pivots = pivots_of(chain, element);
    const std::size_t link = element / chain.elements_per_link;
    Complex<Real> front[8][8];
    put_element(front, pivots == 6, chain.link[link], tangent[element], z);
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        front[i][j].re += carried[i][j].re;
        front[i][j].im += carried[i][j].im;
      }
    }
    if (pivots == 8) {
      front[4][4].re += *chain.tip_mass_kg;
      front[5][5].re += *chain.tip_mass_kg;
    }
    if (element > 0) {
      eliminate<0, 2>(front, factors);
    }
    eliminate<2, 4>(front, factors);
    if (pivots > 4) {
      eliminate<4, 6>(front, factors);
    }
    if (pivots > 6) {
      eliminate<6, 8>(front, factors);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        carried[i][j] = pivots + i < 8 ? front[pivots + i][pivots + j] : Complex<Real>{};
      }
    }
    factors += front_factors(pivots);
  }
}

/// Solves `systems` factored systems in place. System s has the s-th chain_factors() numbers of
/// `factors`, and the real and imaginary parts of its right side in the vectors 2 s and 2 s + 1 of
/// `x`, each of 2 * rows entries. The pin's rows must be zero.
template <std::size_t systems, class Real, class Constant>
inline void solve_fronts(const ChainTables<Constant>& chain, const Complex<Real>* factors,
                         Real* x) {
  using namespace front_detail;
  const std::size_t size = 2 * chain.rows;
  const std::size_t elements = chain.links * chain.elements_per_link;
  const std::size_t all_factors = chain_factors(chain.links, chain.elements_per_link);
  std::size_t first = 0;  // first unknown of the front
  const auto for_each_system = [&](const auto& substitute) {
    for (std::size_t system = 0; system < systems; ++system) {
      Real* const re = x + 2 * system * size + first;
      Real* const im = re + size;
      Complex<Real> z[8];
      for_each_place<0, 8>([&](auto i) { z[i.value] = {re[i.value], im[i.value]}; });
      substitute(factors + system * all_factors, z);
      for_each_place<0, 8>([&](auto i) {
        re[i.value] = z[i.value].re;
        im[i.value] = z[i.value].im;
      });
    }
  };
  for (std::size_t element = 0; element < elements; ++element) {
    const std::size_t pivots = pivots_of(chain, element);
    for_each_system([&](const Complex<Real>* f, Complex<Real>(&z)[8]) {
      pivots == 4   ? substitute_forward<4>(f, z)
      : pivots == 6 ? substitute_forward<6>(f, z)
                    : substitute_forward<8>(f, z);
    });
    first += pivots;
    factors += front_factors(pivots);
  }
  for (std::size_t element = elements; element-- > 0;) {
    const std::size_t pivots = pivots_of(chain, element);
    first -= pivots;
    factors -= front_factors(pivots);
    for_each_system([&](const Complex<Real>* f, Complex<Real>(&z)[8]) {
      pivots == 4   ? substitute_backward<4>(f, z)
      : pivots == 6 ? substitute_backward<6>(f, z)
                    : substitute_backward<8>(f, z);
    });
  }
}

}  // namespace oblique::solver
