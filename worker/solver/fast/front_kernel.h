#pragma once

#include <cstddef>

#include "worker/solver/reference/chain_kernel.h"

/// (M + z K) x = b for complex z and a whole chain, packs of lanes: LDLT without pivoting, element
/// by element. An element's eight unknowns are a dense front; the four of its left node are
/// eliminated, and what is left is carried into the next front. Rows come as in Chain, x before y,
/// so the half bandwidth is 7, and of its rows only the part is computed that is not zero.
namespace oblique::solver {

template <class Real>
struct LaneComplex {
  Real re;
  Real im;
};

/// Pivots and columns below them, column by column: rows 1 to 7 of the first, 2 to 7 of the
/// second...
template <class Real>
struct ElementFront {
  LaneComplex<Real> inverse_pivot[4];
  LaneComplex<Real> below[22];
};
/// The right node of a link's last element: at a joint the slope of the inner link, which no other
/// element has, at the tip all that is left.
template <class Real>
struct EndFront {
  LaneComplex<Real> inverse_pivot[4];
  LaneComplex<Real> below[6];
};

namespace front_detail {

template <std::size_t number>
struct Place {
  static constexpr std::size_t value = number;
};

/// operation(Place<first>), ..., operation(Place<last - 1>): a loop that is unrolled, whatever the
/// compiler thinks of its length.
template <std::size_t first, std::size_t last, class Operation>
inline void for_each_place(const Operation& operation) {
  if constexpr (first < last) {
    operation(Place<first>{});
    for_each_place<first + 1, last>(operation);
  }
}

template <class Real>
inline LaneComplex<Real> product(const LaneComplex<Real>& a, const LaneComplex<Real>& b) {
  return {less_product(a.re * b.re, a.im, b.im), plus_product(a.re * b.im, a.im, b.re)};
}
/// c - a b.
template <class Real>
inline LaneComplex<Real> less(const LaneComplex<Real>& c, const LaneComplex<Real>& a,
                              const LaneComplex<Real>& b) {
  return {plus_product(less_product(c.re, a.re, b.re), a.im, b.im),
          less_product(less_product(c.im, a.re, b.im), a.im, b.re)};
}
template <class Real>
inline LaneComplex<Real> inverse(const LaneComplex<Real>& a) {
  const Real scale = 1.0 / plus_product(a.re * a.re, a.im, a.im);
  return {a.re * scale, (0.0 - a.im) * scale};
}

/// Where column `pivot` of a front of `size` rows begins in `below`.
constexpr std::size_t column_start(std::size_t size, std::size_t pivot) {
  return pivot * (2 * size - 1 - pivot) / 2;
}

/// Copies the lower triangle of that many rows of `from`, from row and column `first` on.
template <std::size_t size, class Real>
inline void copy_corner(const LaneComplex<Real> (&from)[size][size], std::size_t first,
                        std::size_t rows, LaneComplex<Real> (&to)[4][4]) {
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      to[i][j] = from[first + i][first + j];
    }
  }
}

/// Eliminates the first `pivots` unknowns of a symmetric front; only its lower triangle counts.
template <std::size_t pivots, std::size_t size, class Real>
inline void eliminate(LaneComplex<Real> (&front)[size][size], LaneComplex<Real>* inverse_pivot,
                      LaneComplex<Real>* below) {
  for_each_place<0, pivots>([&](auto pivot) {
    constexpr std::size_t k = decltype(pivot)::value;
    const LaneComplex<Real> inverse_of_pivot = inverse(front[k][k]);
    inverse_pivot[k] = inverse_of_pivot;
    for_each_place<k + 1, size>([&](auto column) {
      constexpr std::size_t j = decltype(column)::value;
      const LaneComplex<Real> factor = product(front[j][k], inverse_of_pivot);
      for_each_place<j, size>([&](auto row) {
        constexpr std::size_t i = decltype(row)::value;
        front[i][j] = less(front[i][j], front[i][k], factor);
      });
      below[column_start(size, k) + j - k - 1] = factor;
    });
  });
}

template <std::size_t pivots, std::size_t size, class Real>
inline void substitute_forward(const LaneComplex<Real>* below, LaneComplex<Real>* x) {
  for_each_place<0, pivots>([&](auto pivot) {
    constexpr std::size_t k = decltype(pivot)::value;
    for_each_place<k + 1, size>([&](auto row) {
      constexpr std::size_t i = decltype(row)::value;
      x[i] = less(x[i], below[column_start(size, k) + i - k - 1], x[k]);
    });
  });
}

template <std::size_t pivots, std::size_t size, class Real>
inline void substitute_backward(const LaneComplex<Real>* inverse_pivot,
                                const LaneComplex<Real>* below, LaneComplex<Real>* x) {
  for_each_place<0, pivots>([&](auto place) {
    constexpr std::size_t k = pivots - 1 - decltype(place)::value;
    LaneComplex<Real> value = product(x[k], inverse_pivot[k]);
    // The row that became known last comes last: what waits for it is then short.
    for_each_place<0, size - 1 - k>([&](auto later) {
      constexpr std::size_t i = size - 1 - decltype(later)::value;
      value = less(value, below[column_start(size, k) + i - k - 1], x[i]);
    });
    x[k] = value;
  });
}

/// Adds a block of M + z K at (row, column), and its mirror where it lies on the diagonal's right.
template <class Real, class Constant>
inline void put_block(LaneComplex<Real> (&front)[8][8], std::size_t row, std::size_t column,
                      const Constant& mass, const LaneComplex<Real>& z,
                      const SymmetricPair<Real>& K) {
  front[row][column] = {plus_product(mass, z.re, K.xx), z.im * K.xx};
  front[row + 1][column] = {z.re * K.xy, z.im * K.xy};
  front[row][column + 1] = front[row + 1][column];
  front[row + 1][column + 1] = {plus_product(mass, z.re, K.yy), z.im * K.yy};
}

/// M + z K of one element, its left node first, then p_j and s_j, or at a joint s_j and p_j.
template <class Real, class Constant>
inline void put_element(LaneComplex<Real> (&front)[8][8], bool ends_at_joint,
                        const ElementConstants<Constant>& k, const TangentBlocks<Real>& tangent,
                        const LaneComplex<Real>& z) {
  const std::size_t p = ends_at_joint ? 6 : 4;
  const std::size_t s = ends_at_joint ? 4 : 6;
  const LaneComplex<Real> minus_z{0.0 - z.re, 0.0 - z.im};
  put_block(front, 0, 0, k.m_pp, z, tangent.pp);
  put_block(front, 2, 0, k.m_ps, z, tangent.ps_i);
  put_block(front, 2, 2, k.m_ss, z, tangent.ss_ii);
  put_block(front, p, 0, k.n_pp, minus_z, tangent.pp);
  put_block(front, p, 2, k.n_ps, minus_z, tangent.ps_i);
  put_block(front, p, p, k.m_pp, z, tangent.pp);
  put_block(front, s, 0, 0.0 - k.n_ps, z, tangent.ps_j);
  put_block(front, s, 2, 0.0 - k.n_ss, z, tangent.ss_ij);
  put_block(front, s, s, k.m_ss, z, tangent.ss_jj);
  put_block(front, 6, 4, 0.0 - k.m_ps, minus_z, tangent.ps_j);
}

template <class Real>
inline void add_corner(const LaneComplex<Real> (&carried)[4][4], LaneComplex<Real> (&front)[8][8]) {
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      front[i][j].re += carried[i][j].re;
      front[i][j].im += carried[i][j].im;
    }
  }
}

/// Row and column of the pin's position become those of the unit matrix.
template <class Real>
inline void hold_pin(LaneComplex<Real> (&front)[8][8]) {
  for (std::size_t j = 0; j < 2; ++j) {
    for (std::size_t i = j; i < 8; ++i) {
      front[i][j] = {};
    }
    front[j][j].re = front[j][j].re + 1.0;
  }
}

}  // namespace front_detail

/// Factors M + z K: one front an element and one end a link.
template <class Real, class Constant>
inline void factor_fronts(const ChainTables<Constant>& chain, const TangentBlocks<Real>* tangent,
                          const LaneComplex<Real>& z, ElementFront<Real>* fronts,
                          EndFront<Real>* ends) {
  using namespace front_detail;
  LaneComplex<Real> carried[4][4]{};
  for (std::size_t link = 0; link < chain.links; ++link) {
    for (std::size_t e = 0; e < chain.elements_per_link; ++e, ++tangent, ++fronts) {
      const bool is_last = e + 1 == chain.elements_per_link;
      const bool ends_at_tip = is_last && link + 1 == chain.links;
      LaneComplex<Real> front[8][8];
      put_element(front, is_last && !ends_at_tip, chain.link[link], *tangent, z);
      add_corner(carried, front);
      if (link == 0 && e == 0) {
        hold_pin(front);
      }
      if (ends_at_tip) {
        front[4][4].re += *chain.tip_mass_kg;
        front[5][5].re += *chain.tip_mass_kg;
      }
      eliminate<4>(front, fronts->inverse_pivot, fronts->below);
      copy_corner(front, 4, 4, carried);
    }
    if (link + 1 == chain.links) {
      eliminate<4>(carried, ends[link].inverse_pivot, ends[link].below);
      return;
    }
    eliminate<2>(carried, ends[link].inverse_pivot, ends[link].below);
    LaneComplex<Real> joint[4][4]{};
    copy_corner(carried, 2, 2, joint);
    copy_corner(joint, 0, 4, carried);
  }
}

/// Solves in place for `systems` factored matrices and right sides at once: system s has its fronts
/// from fronts[s elements] on, its ends from ends[s links] on, and its right side, real and
/// imaginary parts, in the vectors 2 s and 2 s + 1 of `size` entries of `x`. The pin's rows must be
/// zero.
template <std::size_t systems, class Real>
inline void solve_fronts(std::size_t links, std::size_t elements_per_link,
                         const ElementFront<Real>* fronts, const EndFront<Real>* ends,
                         std::size_t size, Real* x) {
  using namespace front_detail;
  const std::size_t elements = links * elements_per_link;
  LaneComplex<Real> z[8];
  const auto take = [&](std::size_t system, std::size_t first) {
    const Real* re = x + 2 * system * size + first;
    for_each_place<0, 8>([&](auto place) {
      constexpr std::size_t i = decltype(place)::value;
      z[i] = {re[i], re[i + size]};
    });
  };
  const auto give = [&](std::size_t system, std::size_t first) {
    Real* re = x + 2 * system * size + first;
    for_each_place<0, 8>([&](auto place) {
      constexpr std::size_t i = decltype(place)::value;
      re[i] = z[i].re;
      re[i + size] = z[i].im;
    });
  };
  std::size_t first = 0;  // row of the element's first unknown, counting x and y
  std::size_t element = 0;
  for (std::size_t link = 0; link < links; ++link) {
    for (std::size_t e = 0; e < elements_per_link; ++e, ++element) {
      const bool is_last = e + 1 == elements_per_link;
      for (std::size_t system = 0; system < systems; ++system) {
        take(system, first);
        substitute_forward<4, 8>(fronts[system * elements + element].below, z);
        if (is_last) {
          const EndFront<Real>& end = ends[system * links + link];
          if (link + 1 == links) {
            substitute_forward<4, 4>(end.below, z + 4);
          } else {
            substitute_forward<2, 4>(end.below, z + 4);
          }
        }
        give(system, first);
      }
      first += is_last ? 6 : 4;
    }
  }
  for (std::size_t link = links; link-- > 0;) {
    for (std::size_t e = elements_per_link; e-- > 0;) {
      --element;
      const bool is_last = e + 1 == elements_per_link;
      first -= is_last ? 6 : 4;
      for (std::size_t system = 0; system < systems; ++system) {
        take(system, first);
        if (is_last) {
          const EndFront<Real>& end = ends[system * links + link];
          if (link + 1 == links) {
            substitute_backward<4, 4>(end.inverse_pivot, end.below, z + 4);
          } else {
            substitute_backward<2, 4>(end.inverse_pivot, end.below, z + 4);
          }
        }
        const ElementFront<Real>& front = fronts[system * elements + element];
        substitute_backward<4, 8>(front.inverse_pivot, front.below, z);
        give(system, first);
      }
    }
  }
}

}  // namespace oblique::solver
