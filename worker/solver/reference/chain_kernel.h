#pragma once

#include <cstddef>

#include "worker/solver/reference/element_force.h"

/// The innermost loops: accelerations of the chain for numbers or packs of lanes, from plain
/// tables. `Real` and `Constant` as in element_force.h. Nothing is shared with other translation
/// units.
namespace oblique::solver {

/// Half-bandwidth of every matrix of the eliminated chain: an element spans four consecutive rows.
inline constexpr std::size_t kHalfBandwidth = 3;

/// One row of A = L D Lᵀ, L with unit diagonal. Entries beyond the matrix are zero.
template <class Constant>
struct FactorRow {
  Constant left[kHalfBandwidth];  ///< L(i, i-1), L(i, i-2), L(i, i-3)
  Constant inverse_pivot;
};

/// Constants of the momentum balance of a link and all links outside it.
template <class Constant>
struct LinkBalance {
  Constant inner_end_kg;     ///< mass that the link adds to the row of its inner end
  Constant weight_beyond_N;  ///< weight of the link and all links outside it
};

/// Pointers to the tables of a Chain or of LaneTables. Elements of a link have equal lengths, so
/// the slopes at the nodes between them have no weight or momentum.
template <class Constant>
struct ChainTables {
  std::size_t rows;
  std::size_t tip_row;
  std::size_t links;
  std::size_t elements_per_link;
  const ElementConstants<Constant>* link;  ///< by link
  const FactorRow<Constant>* mass_factor;  ///< `rows` rows, then kHalfBandwidth rows of zeros
  const Constant* weight_N;                ///< generalised gravity along y, by row
  const Constant* momentum_kg;             ///< momentum per rate, by row
  const LinkBalance<Constant>* balance;    ///< by link
  const Constant* tip_mass_kg;
};

/// Rows of an element's positions and slopes. At a joint the inner link's slope comes first.
struct ElementRows {
  std::size_t p_i;
  std::size_t s_i;
  std::size_t p_j;
  std::size_t s_j;
};

[[gnu::always_inline]] inline ElementRows rows_of_element(std::size_t row, bool ends_at_joint) {
  return {row, row + 1, row + (ends_at_joint ? 3 : 2), row + (ends_at_joint ? 2 : 3)};
}

template <class Real>
inline PlanarVector<Real> pair_at(const Real* values, std::size_t row) {
  return {values[2 * row], values[2 * row + 1]};
}

template <class Real>
inline void put_pair(Real* values, std::size_t row, const PlanarVector<Real>& pair) {
  values[2 * row] = pair.x;
  values[2 * row + 1] = pair.y;
}

/// Solves L y = f row by row downwards. The preceding row enters each sum last, so that a row waits
/// for one multiply-add only. x and y are separate, here and below, because compilers copy pairs of
/// packs through memory.
template <class Real>
class ForwardSubstitution {
 public:
  template <class Constant>
  inline PlanarVector<Real> next(const FactorRow<Constant>& row, const Real& fx, const Real& fy) {
    const Real x = after_three(row, fx, x_);
    const Real y = after_three(row, fy, y_);
    x_[2] = x_[1];
    y_[2] = y_[1];
    x_[1] = x_[0];
    y_[1] = y_[0];
    x_[0] = x;
    y_[0] = y;
    return {x, y};
  }

 private:
  template <class Constant>
  static inline Real after_three(const FactorRow<Constant>& row, const Real& f,
                                 const Real (&before)[kHalfBandwidth]) {
    const Real far = less_product(f, row.left[2], before[2]);
    return less_product(less_product(far, row.left[1], before[1]), row.left[0], before[0]);
  }

  Real x_[kHalfBandwidth]{};  ///< components in the last three rows, newest first
  Real y_[kHalfBandwidth]{};
};

/// Solves D Lᵀ z = y from row `rows` - 1 down to `first`. Calls `take(row, x, y)` with z in each
/// row. `factor` has `rows` rows, followed by kHalfBandwidth rows of zeros.
template <class Constant, class Real, class Take>
inline void substitute_back(const FactorRow<Constant>* factor, std::size_t rows, std::size_t first,
                            const Real* y, const Take& take) {
  // Each iteration of the loop solves three rows. A row overwrites the variables of the third row
  // before it, which saves copies.
  Real ax{}, ay{}, bx{}, by{}, cx{}, cy{};
  const auto next = [&](std::size_t row, Real& zx, Real& zy, const Real& x_1, const Real& y_1,
                        const Real& x_2, const Real& y_2) {
    const FactorRow<Constant>* l = factor + row;
    const Real far_x = less_product(l->inverse_pivot * y[2 * row], l[3].left[2], zx);
    const Real far_y = less_product(l->inverse_pivot * y[2 * row + 1], l[3].left[2], zy);
    zx = less_product(less_product(far_x, l[2].left[1], x_2), l[1].left[0], x_1);
    zy = less_product(less_product(far_y, l[2].left[1], y_2), l[1].left[0], y_1);
    take(row, zx, zy);
  };
  std::size_t end = rows;
  for (; end >= first + 3; end -= 3) {
    next(end - 1, cx, cy, ax, ay, bx, by);
    next(end - 2, bx, by, cx, cy, ax, ay);
    next(end - 3, ax, ay, bx, by, cx, cy);
  }
  if (end > first) {
    next(end - 1, cx, cy, ax, ay, bx, by);
  }
  if (end > first + 1) {
    next(end - 2, bx, by, cx, cy, ax, ay);
  }
}

/// Eqs. 9 to 13: y = L^-1 (Q_gravity + S_tipᵀ F - dU/dq), forces and substitution in one pass along
/// the chain. `q` and `y` have 2 * rows entries. The pin's row of `y` has no meaning.
template <class Constant, class Real>
inline void substitute_forces(const ChainTables<Constant>& chain, const Real* q, const Real& ft_N,
                              const Real& fn_N, Real* y) {
  using Vector = PlanarVector<Real>;
  ForwardSubstitution<Real> forward;
  const auto finish = [&](std::size_t row, const Real& fx, const Real& fy) {
    const PlanarVector<Real> y_row = forward.next(chain.mass_factor[row], fx, fy);
    y[2 * row] = y_row.x;
    y[2 * row + 1] = y_row.y;
  };
  std::size_t row = 0;      // row of the position at the element's left end
  Vector pull_from_left{};  // sum of the forces of the elements on the left, on the row of p
  for (std::size_t link = 0; link < chain.links; ++link) {
    const ElementConstants<Constant>& constants = chain.link[link];
    Vector turn_from_left{Real{}, Real{} - chain.weight_N[row + 1]};
    for (std::size_t e = 1; e <= chain.elements_per_link; ++e) {
      const bool ends_at_joint = e == chain.elements_per_link && link + 1 < chain.links;
      const ElementRows at = rows_of_element(row, ends_at_joint);
      const ElasticForces<Real> elastic = elastic_forces(
          pair_at(q, row), pair_at(q, row + 1), pair_at(q, at.p_j), pair_at(q, at.s_j), constants);
      finish(row, elastic.pull.x - pull_from_left.x,
             elastic.pull.y - pull_from_left.y + chain.weight_N[row]);
      finish(row + 1, (elastic.by_d.x - elastic.by_t.x) - turn_from_left.x,
             (elastic.by_d.y - elastic.by_t.y) - turn_from_left.y);
      pull_from_left.x = elastic.pull.x;
      pull_from_left.y = elastic.pull.y;
      turn_from_left.x = elastic.by_d.x + elastic.by_t.x;
      turn_from_left.y = elastic.by_d.y + elastic.by_t.y;
      row = at.p_j;
    }
    if (link + 1 < chain.links) {
      finish(row - 1, Real{} - turn_from_left.x, chain.weight_N[row - 1] - turn_from_left.y);
    } else {
      finish(row, ft_N - pull_from_left.x, fn_N + chain.weight_N[row] - pull_from_left.y);
      finish(row + 1, Real{} - turn_from_left.x, chain.weight_N[row + 1] - turn_from_left.y);
    }
  }
}

/// q'' = L^-T D^-1 y. Calls `take(row, x'', y'')` from the tip to the row after the pin.
template <class Constant, class Real, class Take>
inline void substitute_accelerations(const ChainTables<Constant>& chain, const Real* y,
                                     const Take& take) {
  substitute_back(chain.mass_factor, chain.rows, 1, y, take);
}

/// Eq. 13, joints eliminated: q'' = M^-1 (Q_gravity + S_tipᵀ F - dU/dq). `q` and `acceleration`
/// have 2 * rows entries.
template <class Constant, class Real>
inline void chain_accelerations(const ChainTables<Constant>& chain, const Real* q, const Real& ft_N,
                                const Real& fn_N, Real* acceleration) {
  substitute_forces(chain, q, ft_N, fn_N, acceleration);
  substitute_accelerations(chain, acceleration,
                           [&](std::size_t row, const Real& ax, const Real& ay) {
                             put_pair(acceleration, row, PlanarVector<Real>{ax, ay});
                           });
  put_pair(acceleration, 0, PlanarVector<Real>{});
}

/// Sums the momentum of each link and all links outside it. Needs the rates of all rows in the
/// order from the tip to the row after the pin.
template <class Constant, class Real>
class LinkMomenta {
 public:
  /// Writes two entries per link to `momenta_Ns`.
  LinkMomenta(const ChainTables<Constant>& chain, Real* momenta_Ns)
      : chain_(chain),
        momenta_Ns_(momenta_Ns),
        link_(chain.links - 1),
        inner_end_(link_ * rows_a_link()) {}

  inline void add(std::size_t row, const PlanarVector<Real>& v) {
    if (row == inner_end_) {
      put_pair(momenta_Ns_, link_, plus_product(sum_, chain_.balance[link_].inner_end_kg, v));
      --link_;
      inner_end_ -= rows_a_link();
      sum_ = plus_product(sum_, chain_.momentum_kg[row], v);
      return;
    }
    // Slopes between elements have no momentum.
    const std::size_t place = row - inner_end_;
    const bool is_slope_between = place % 2 == 1 && place > 1 && place + 1 < rows_a_link();
    if (!is_slope_between) {
      sum_ = plus_product(sum_, chain_.momentum_kg[row], v);
    }
    if (row == 1) {  // the pin does not move
      put_pair(momenta_Ns_, 0, sum_);
    }
  }

 private:
  std::size_t rows_a_link() const { return 2 * chain_.elements_per_link + 1; }

  const ChainTables<Constant>& chain_;
  Real* momenta_Ns_;
  std::size_t link_;       ///< the link whose inner end comes next
  std::size_t inner_end_;  ///< row of this inner end
  PlanarVector<Real> sum_{};
};

/// Square of the mean reaction on each link's inner end over a step of h seconds: the change of the
/// momentum of this and all outer links, less the impulses of contact forces and weight, over h.
template <class Constant, class Real>
inline void mean_reactions_squared(const ChainTables<Constant>& chain,
                                   const Real* momenta_before_Ns, const Real* momenta_after_Ns,
                                   const PlanarVector<Real>& contact_impulse_Ns,
                                   const Real& inverse_h_Hz, Real* squared_N2) {
  for (std::size_t link = 0; link < chain.links; ++link) {
    const PlanarVector<Real> before = pair_at(momenta_before_Ns, link);
    const PlanarVector<Real> after = pair_at(momenta_after_Ns, link);
    PlanarVector<Real> mean = inverse_h_Hz * (after - before - contact_impulse_Ns);
    mean.y = mean.y + chain.balance[link].weight_beyond_N;
    squared_N2[link] = dot(mean, mean);
  }
}

}  // namespace oblique::solver
