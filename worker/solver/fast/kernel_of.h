#pragma once

#include <cstddef>
#include <string_view>

#include "worker/solver/fast/front_kernel.h"
#include "worker/solver/fast/kernels.h"
#include "worker/solver/fast/lane_pack.h"
#include "worker/solver/reference/pefrl.h"

namespace oblique::solver {

/// One step of Gauss collocation for the lanes of `Pack`, a LanePack; compiled once for each
/// instruction set. Unknowns are the accelerations of all stages, found by a simplified Newton
/// method: one tangent a step, at the middle of what is predicted.
template <class Pack>
class CollocationStep {
 public:
  CollocationStep(const GaussCollocation& rule, const CollocationArrays& arrays)
      : rule_(rule), arrays_(arrays), chain_(arrays.chain.of<Pack>()), size_(2 * chain_.rows) {}

  /// Predicts with the mean acceleration of the step before, and factors M + h^2 lambda^2 K.
  inline void prepare() const;
  /// One iteration in the lanes that are active; writes the squared size of their corrections.
  inline void iterate() const;
  /// Writes the state at the end of the step, and the squared size of what was hard to resolve.
  inline void finish() const;

 private:
  using Vector = PlanarVector<Pack>;
  static constexpr std::size_t kStages = GaussCollocation::kStages;
  static constexpr std::size_t kPairs = GaussCollocation::kPairs;

  static Pack* packs(double* numbers) { return reinterpret_cast<Pack*>(numbers); }
  template <class Item>
  static Item* items(double* numbers) {
    return reinterpret_cast<Item*>(numbers);
  }

  inline void put_tangents() const;
  inline void put_residual(std::size_t stage) const;

  const GaussCollocation& rule_;
  const CollocationArrays& arrays_;
  ChainTables<Pack> chain_;
  std::size_t size_;  ///< entries of a vector
};

template <class Pack>
void CollocationStep<Pack>::prepare() const {
  const Pack h = *packs(arrays_.h_s);
  const Pack squared_h = h * h;
  const Pack* q = packs(arrays_.state);
  const Pack* v = q + size_;
  const Pack* mean = v + size_;
  for (std::size_t i = 0; i < size_; ++i) {
    const Pack by_v = h * v[i];
    const Pack by_mean = 0.5 * (squared_h * mean[i]);
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      const double c = rule_.node[stage];
      packs(arrays_.stage_a)[stage * size_ + i] = mean[i];
      packs(arrays_.stage_q)[stage * size_ + i] = q[i] + plus_product(c * by_v, c * c, by_mean);
    }
  }
  put_tangents();
  const std::size_t elements = chain_.links * chain_.elements_per_link;
  for (std::size_t pair = 0; pair < kPairs; ++pair) {
    const LaneComplex<Pack> z{rule_.squared_re[pair] * squared_h,
                              rule_.squared_im[pair] * squared_h};
    factor_fronts(chain_, items<const TangentBlocks<Pack>>(arrays_.tangents), z,
                  items<ElementFront<Pack>>(arrays_.fronts) + pair * elements,
                  items<EndFront<Pack>>(arrays_.ends) + pair * chain_.links);
  }
}

template <class Pack>
void CollocationStep<Pack>::put_tangents() const {
  const Pack* before = packs(arrays_.stage_q) + (kStages - 1) / 2 * size_;
  const Pack* after = packs(arrays_.stage_q) + kStages / 2 * size_;
  const auto middle = [&](std::size_t row) {
    return 0.5 * (pair_at(before, row) + pair_at(after, row));
  };
  auto* tangent = items<TangentBlocks<Pack>>(arrays_.tangents);
  std::size_t row = 0;
  for (std::size_t link = 0; link < chain_.links; ++link) {
    for (std::size_t e = 1; e <= chain_.elements_per_link; ++e) {
      const bool ends_at_joint = e == chain_.elements_per_link && link + 1 < chain_.links;
      const ElementRows at = rows_of_element(row, ends_at_joint);
      *tangent++ = element_tangent(middle(row), middle(row + 1), middle(at.p_j), middle(at.s_j),
                                   chain_.link[link]);
      row = at.p_j;
    }
  }
}

/// Q_gravity - dU/dq - M a of a stage.
template <class Pack>
void CollocationStep<Pack>::put_residual(std::size_t stage) const {
  const Pack* q = packs(arrays_.stage_q) + stage * size_;
  const Pack* a = packs(arrays_.stage_a) + stage * size_;
  Pack* residual = packs(arrays_.work) + stage * size_;
  const auto weight = [&](std::size_t row) { return Vector{{}, chain_.weight_N[row]}; };
  std::size_t row = 0;
  Vector on_p = weight(0);
  for (std::size_t link = 0; link < chain_.links; ++link) {
    const ElementConstants<Pack>& m = chain_.link[link];
    Vector on_s = weight(row + 1);
    for (std::size_t e = 1; e <= chain_.elements_per_link; ++e) {
      const bool ends_at_joint = e == chain_.elements_per_link && link + 1 < chain_.links;
      const ElementRows at = rows_of_element(row, ends_at_joint);
      const ElasticForces<Pack> f = elastic_forces(pair_at(q, row), pair_at(q, row + 1),
                                                   pair_at(q, at.p_j), pair_at(q, at.s_j), m);
      const Vector ap_i = pair_at(a, row);
      const Vector as_i = pair_at(a, row + 1);
      const Vector ap_j = pair_at(a, at.p_j);
      const Vector as_j = pair_at(a, at.s_j);
      on_p = less_product(less_product(on_p + f.pull, m.m_pp, ap_i), m.m_ps, as_i);
      put_pair(residual, row, plus_product(less_product(on_p, m.n_pp, ap_j), m.n_ps, as_j));
      on_s = less_product(less_product(on_s + (f.by_d - f.by_t), m.m_ps, ap_i), m.m_ss, as_i);
      put_pair(residual, row + 1, plus_product(less_product(on_s, m.n_ps, ap_j), m.n_ss, as_j));
      const Vector by_pull = weight(at.p_j) - f.pull;
      on_p = less_product(less_product(by_pull, m.n_pp, ap_i), m.n_ps, as_i);
      on_p = plus_product(less_product(on_p, m.m_pp, ap_j), m.m_ps, as_j);
      const Vector by_slope = weight(at.s_j) - (f.by_d + f.by_t);
      on_s = plus_product(plus_product(by_slope, m.n_ps, ap_i), m.n_ss, as_i);
      on_s = less_product(plus_product(on_s, m.m_ps, ap_j), m.m_ss, as_j);
      row = at.p_j;
    }
    if (link + 1 < chain_.links) {
      put_pair(residual, row - 1, on_s);
    } else {
      put_pair(residual, row, less_product(on_p, *chain_.tip_mass_kg, pair_at(a, row)));
      put_pair(residual, row + 1, on_s);
    }
  }
  put_pair(residual, 0, Vector{});
}

template <class Pack>
void CollocationStep<Pack>::iterate() const {
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    put_residual(stage);
  }
  Pack* work = packs(arrays_.work);
  for (std::size_t i = 0; i < size_; ++i) {
    Pack r[kStages];
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      r[stage] = work[stage * size_ + i];
    }
    for (std::size_t pair = 0; pair < kPairs; ++pair) {
      Pack re = rule_.into_re[pair][0] * r[0];
      Pack im = rule_.into_im[pair][0] * r[0];
      for (std::size_t stage = 1; stage < kStages; ++stage) {
        re = plus_product(re, rule_.into_re[pair][stage], r[stage]);
        im = plus_product(im, rule_.into_im[pair][stage], r[stage]);
      }
      work[2 * pair * size_ + i] = re;
      work[(2 * pair + 1) * size_ + i] = im;
    }
  }
  solve_fronts<kPairs>(chain_.links, chain_.elements_per_link,
                       items<const ElementFront<Pack>>(arrays_.fronts),
                       items<const EndFront<Pack>>(arrays_.ends), size_, work);
  const Pack active = *packs(arrays_.active);
  const Pack squared_h = *packs(arrays_.h_s) * *packs(arrays_.h_s);
  Pack squares{};
  for (std::size_t i = 0; i < size_; ++i) {
    Pack z[2 * kPairs];
    for (std::size_t k = 0; k < 2 * kPairs; ++k) {
      z[k] = active * work[k * size_ + i];
    }
    Pack sum{};
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      Pack& a = packs(arrays_.stage_a)[stage * size_ + i];
      Pack& q = packs(arrays_.stage_q)[stage * size_ + i];
      Pack by_a = rule_.back_re[stage][0] * z[0];
      Pack by_q = rule_.shift_re[stage][0] * z[0];
      by_a = plus_product(by_a, rule_.back_im[stage][0], z[1]);
      by_q = plus_product(by_q, rule_.shift_im[stage][0], z[1]);
      for (std::size_t pair = 1; pair < kPairs; ++pair) {
        by_a = plus_product(by_a, rule_.back_re[stage][pair], z[2 * pair]);
        by_q = plus_product(by_q, rule_.shift_re[stage][pair], z[2 * pair]);
        by_a = plus_product(by_a, rule_.back_im[stage][pair], z[2 * pair + 1]);
        by_q = plus_product(by_q, rule_.shift_im[stage][pair], z[2 * pair + 1]);
      }
      by_q = squared_h * by_q;
      a += by_a;
      q += by_q;
      sum = plus_product(sum, by_q, by_q);
    }
    squares = plus_product(squares, packs(arrays_.mass_kg)[i / 2], sum);
  }
  *packs(arrays_.squares) = squares;
}

template <class Pack>
void CollocationStep<Pack>::finish() const {
  const Pack h = *packs(arrays_.h_s);
  const Pack* state = packs(arrays_.state);
  Pack* next = packs(arrays_.next);
  Pack squares{};
  for (std::size_t i = 0; i < size_; ++i) {
    Pack a = packs(arrays_.stage_a)[i];
    Pack by_v = rule_.weight[0] * a;
    Pack by_q = rule_.position_weight[0] * a;
    Pack highest = rule_.legendre[kStages - 1][0] * a;
    Pack second = rule_.legendre[kStages - 2][0] * a;
    for (std::size_t stage = 1; stage < kStages; ++stage) {
      a = packs(arrays_.stage_a)[stage * size_ + i];
      by_v = plus_product(by_v, rule_.weight[stage], a);
      by_q = plus_product(by_q, rule_.position_weight[stage], a);
      highest = plus_product(highest, rule_.legendre[kStages - 1][stage], a);
      second = plus_product(second, rule_.legendre[kStages - 2][stage], a);
    }
    const Pack v = state[size_ + i];
    next[2 * size_ + i] = by_v;
    next[size_ + i] = plus_product(v, h, by_v);
    next[i] = plus_product(state[i], h, plus_product(v, h, by_q));
    squares = plus_product(squares, packs(arrays_.mass_kg)[i / 2],
                           plus_product(highest * highest, second, second));
  }
  *packs(arrays_.squares) = (h * h) * squares;
}

/// Gathers the momenta of all links at both ends of a step.
template <class Constant, class Pack>
struct MomentaOfStep {
  LinkMomenta<Constant, Pack> before;
  LinkMomenta<Constant, Pack> after;

  void start(std::size_t row, const PlanarVector<Pack>& v) { before.add(row, v); }
  void end(std::size_t row, const PlanarVector<Pack>& v) { after.add(row, v); }
};

/// pefrl_step() of all lanes of `Pack`, a LanePack, with constants shared by all lanes or a pack of
/// them.
template <class Pack, class Constant>
void step_packs(const ChainTables<Constant>& chain, const LaneArrays& arrays) {
  const auto packs = [](double* numbers) { return reinterpret_cast<Pack*>(numbers); };
  const Pack* f = packs(arrays.force);
  const AffineContactForce<Pack> force{f[0], f[1], f[2], f[3], f[4], f[5], f[6]};
  Pack* momenta_before = packs(arrays.momenta);
  Pack* momenta_after = momenta_before + 2 * chain.links;
  const Pack* q = packs(arrays.q);
  const Pack* v = packs(arrays.v);
  const ContactIntegrals<Pack> integrals =
      pefrl_step(chain, force, *packs(arrays.h_s), q, v, packs(arrays.q_next), packs(arrays.v_next),
                 packs(arrays.scratch),
                 MomentaOfStep<Constant, Pack>{{chain, momenta_before}, {chain, momenta_after}});
  packs(arrays.integrals)[0] = integrals.impulse_n;
  packs(arrays.integrals)[1] = integrals.impulse_t;
  packs(arrays.integrals)[2] = integrals.work_t;
  mean_reactions_squared(chain, momenta_before, momenta_after,
                         {integrals.impulse_t, integrals.impulse_n}, *packs(arrays.inverse_h_Hz),
                         packs(arrays.reactions));
}

template <class Pack>
[[gnu::flatten]] void step_one_chain(const ChainTables<double>& chain, const LaneArrays& arrays) {
  step_packs<Pack>(chain, arrays);
}

template <class Pack>
[[gnu::flatten]] void step_chains(const LaneTables& chains, const LaneArrays& arrays) {
  step_packs<Pack>(chains.of<Pack>(), arrays);
}

/// Compiled in each kernel_*.cpp with the flags of its instruction set.
template <class Pack>
LaneKernel kernel_of(std::string_view name) {
  using Collocation = CollocationStep<Pack>;
  return {
      .name = name,
      .lanes = Pack::kLanes,
      .step_one_chain = step_one_chain<Pack>,
      .step_chains = step_chains<Pack>,
      .prepare = [](const auto& rule, const auto& arrays) { Collocation(rule, arrays).prepare(); },
      .iterate = [](const auto& rule, const auto& arrays) { Collocation(rule, arrays).iterate(); },
      .finish = [](const auto& rule, const auto& arrays) { Collocation(rule, arrays).finish(); }};
}

}  // namespace oblique::solver
