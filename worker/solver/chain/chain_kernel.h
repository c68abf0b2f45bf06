#pragma once

#include <cstddef>

#include "worker/solver/chain/elastic_kernel.h"

/// The innermost loops: the chain's accelerations for one number or a vector of lanes. Plain tables
/// and templates over `Real` only, so that one source serves every instruction set: nothing here
/// may call an ordinary inline function that other translation units share.
namespace oblique::solver {

/// Half-bandwidth of every matrix of the eliminated chain: an element spans four consecutive rows.
inline constexpr std::size_t kHalfBandwidth = 3;

/// One row of A = L D Lᵀ, L with unit diagonal. Entries beyond the matrix are zero.
struct FactorRow {
  double left[kHalfBandwidth];   ///< L(i, i-1), L(i, i-2), L(i, i-3)
  double below[kHalfBandwidth];  ///< L(i+1, i), L(i+2, i), L(i+3, i)
  double inverse_pivot;
};

/// What the momentum of a link and all beyond it asks for besides the weights of its rows.
struct LinkBalance {
  double inner_end_kg;     ///< the link's own share of the row in which its inner end lies
  double weight_beyond_N;  ///< of the link and all beyond it
};

/// What the loops read. Points into a Chain, which must outlive it.
struct ChainTables {
  std::size_t rows;
  std::size_t tip_row;
  std::size_t links;
  std::size_t elements_per_link;
  const ElasticConstants* link;  ///< of an element of each link
  const FactorRow* mass_factor;
  const double* weight_N;      ///< generalised gravity along y, one a row; there is none along x
  const double* momentum_kg;   ///< one a row: the chain's momentum is the sum of these times v
  const LinkBalance* balance;  ///< of each link
};

/// L y = f, row by row downwards. The row just before comes last into each sum: what rows wait for
/// is then one multiply-add.
template <class Real>
class ForwardSubstitution {
 public:
  inline PlanarVector<Real> next(const FactorRow& row, PlanarVector<Real> f) {
    for (std::size_t d = kHalfBandwidth; d >= 1; --d) {
      f.x -= row.left[d - 1] * before_[d - 1].x;
      f.y -= row.left[d - 1] * before_[d - 1].y;
    }
    before_[2] = before_[1];
    before_[1] = before_[0];
    before_[0] = f;
    return f;
  }

 private:
  PlanarVector<Real> before_[kHalfBandwidth]{};
};

/// D Lᵀ z = y, row by row upwards.
template <class Real>
class BackSubstitution {
 public:
  inline PlanarVector<Real> next(const FactorRow& row, const PlanarVector<Real>& y) {
    PlanarVector<Real> z{y.x * row.inverse_pivot, y.y * row.inverse_pivot};
    for (std::size_t d = kHalfBandwidth; d >= 1; --d) {
      z.x -= row.below[d - 1] * after_[d - 1].x;
      z.y -= row.below[d - 1] * after_[d - 1].y;
    }
    after_[2] = after_[1];
    after_[1] = after_[0];
    after_[0] = z;
    return z;
  }

 private:
  PlanarVector<Real> after_[kHalfBandwidth]{};
};

template <class Real>
inline PlanarVector<Real> pair_at(const Real* values, std::size_t row) {
  return {values[2 * row], values[2 * row + 1]};
}

template <class Real>
inline void put_pair(Real* values, std::size_t row, const PlanarVector<Real>& pair) {
  values[2 * row] = pair.x;
  values[2 * row + 1] = pair.y;
}

/// The way down: y = L^-1 (Q_gravity + S_tipᵀ F - dU/dq), forces and substitution in one pass along
/// the chain. `q` and `y` have 2 rows entries. What it says of the pin's row has no meaning.
template <class Real>
inline void substitute_forces(const ChainTables& chain, const Real* q, const Real& ft_N,
                              const Real& fn_N, Real* y) {
  ForwardSubstitution<Real> forward;
  const auto finish = [&](std::size_t row, const PlanarVector<Real>& force) {
    put_pair(y, row, forward.next(chain.mass_factor[row], force));
  };
  const auto weight = [&](std::size_t row) {
    return PlanarVector<Real>{Real{}, Real{} + chain.weight_N[row]};
  };
  std::size_t row = 0;  // of the position at the element's left end
  PlanarVector<Real> on_p = weight(row);
  for (std::size_t link = 0; link < chain.links; ++link) {
    const ElasticConstants constants = chain.link[link];  // a copy: nothing written below is in it
    PlanarVector<Real> on_s = weight(row + 1);
    for (std::size_t e = 1; e <= chain.elements_per_link; ++e) {
      // At a joint the inner link's slope comes before the position.
      const bool ends_at_joint = e == chain.elements_per_link && link + 1 < chain.links;
      const std::size_t p_row = row + (ends_at_joint ? 3 : 2);
      const std::size_t s_row = row + (ends_at_joint ? 2 : 3);
      const ElasticForces<Real> elastic = elastic_forces(
          pair_at(q, row), pair_at(q, row + 1), pair_at(q, p_row), pair_at(q, s_row), constants);
      finish(row, {on_p.x + elastic.pull.x, on_p.y + elastic.pull.y});
      finish(row + 1,
             {on_s.x + elastic.by_d.x - elastic.by_t.x, on_s.y + elastic.by_d.y - elastic.by_t.y});
      on_p = {Real{} - elastic.pull.x, chain.weight_N[p_row] - elastic.pull.y};
      on_s = {Real{} - elastic.by_d.x - elastic.by_t.x,
              chain.weight_N[s_row] - elastic.by_d.y - elastic.by_t.y};
      row = p_row;
    }
    if (link + 1 < chain.links) {
      finish(row - 1, on_s);
    } else {
      finish(row, {on_p.x + ft_N, on_p.y + fn_N});
      finish(row + 1, on_s);
    }
  }
}

/// The way up: q'' = L^-T D^-1 y, given to `take(row, q'')` from the tip to the row after the pin,
/// which does not move.
template <class Real, class Take>
inline void substitute_accelerations(const ChainTables& chain, const Real* y, const Take& take) {
  BackSubstitution<Real> backward;
  for (std::size_t row = chain.rows; row-- > 1;) {
    take(row, backward.next(chain.mass_factor[row], pair_at(y, row)));
  }
}

/// q'' = M^-1 (Q_gravity + S_tipᵀ F - dU/dq). `q` and `acceleration` have 2 rows entries.
template <class Real>
inline void chain_accelerations(const ChainTables& chain, const Real* q, const Real& ft_N,
                                const Real& fn_N, Real* acceleration) {
  substitute_forces(chain, q, ft_N, fn_N, acceleration);
  substitute_accelerations(chain, acceleration,
                           [&](std::size_t row, const PlanarVector<Real>& value) {
                             put_pair(acceleration, row, value);
                           });
  put_pair(acceleration, 0, PlanarVector<Real>{});
}

/// Momentum of each link and all beyond it, x and y in turn, gathered as rates come row by row from
/// the tip to the row after the pin.
template <class Real>
class LinkMomenta {
 public:
  /// Writes 2 links entries of `momenta_Ns`.
  LinkMomenta(const ChainTables& chain, Real* momenta_Ns)
      : chain_(chain), momenta_Ns_(momenta_Ns), link_(chain.links - 1) {}

  inline void add(std::size_t row, const PlanarVector<Real>& v) {
    const double kg = chain_.momentum_kg[row];
    if (row == link_ * (2 * chain_.elements_per_link + 1)) {
      const double own_kg = chain_.balance[link_].inner_end_kg;
      put_pair(momenta_Ns_, link_,
               PlanarVector<Real>{sum_.x + own_kg * v.x, sum_.y + own_kg * v.y});
      --link_;
    }
    if (kg != 0.0) {  // as it is for slopes between elements of one length
      sum_.x += kg * v.x;
      sum_.y += kg * v.y;
    }
    if (row == 1) {  // the pin does not move
      put_pair(momenta_Ns_, 0, sum_);
    }
  }

 private:
  const ChainTables& chain_;
  Real* momenta_Ns_;
  std::size_t link_;  ///< whose inner end comes next
  PlanarVector<Real> sum_{};
};

/// Squared mean of the reaction on each link's inner end over a step of h seconds, one a link: the
/// change of the momentum of all beyond it, less the impulses of the contact forces and of the
/// weight, over h. Exact but for the step's own error.
template <class Real>
inline void mean_reactions_squared(const ChainTables& chain, const Real* momenta_before_Ns,
                                   const Real* momenta_after_Ns,
                                   const PlanarVector<Real>& contact_impulse_Ns,
                                   const Real& inverse_h_Hz, Real* squared_N2) {
  for (std::size_t link = 0; link < chain.links; ++link) {
    const PlanarVector<Real> before = pair_at(momenta_before_Ns, link);
    const PlanarVector<Real> after = pair_at(momenta_after_Ns, link);
    const Real x = (after.x - before.x - contact_impulse_Ns.x) * inverse_h_Hz;
    const Real y = (after.y - before.y - contact_impulse_Ns.y) * inverse_h_Hz +
                   chain.balance[link].weight_beyond_N;
    squared_N2[link] = x * x + y * y;
  }
}

}  // namespace oblique::solver
