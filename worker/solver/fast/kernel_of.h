#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif
#include <cstddef>
#include <string_view>

#include "worker/solver/fast/front_kernel.h"
#include "worker/solver/fast/kernels.h"
#include "worker/solver/reference/pefrl.h"

namespace oblique::solver {

/// Vectors of the instruction sets that this source is compiled for, with multiply-adds c + a b and
/// c - a b, which AVX2 and AVX-512 round once.
struct BaselineVectors {
  using Vector = double __attribute__((vector_size(16), may_alias));
  static Vector plus_product(Vector c, Vector a, Vector b) { return c + a * b; }
  static Vector less_product(Vector c, Vector a, Vector b) { return c - a * b; }
};

#if defined(__AVX2__) && defined(__FMA__)
struct Avx2Vectors {
  using Vector = double __attribute__((vector_size(32), may_alias));
  static Vector plus_product(Vector c, Vector a, Vector b) { return _mm256_fmadd_pd(a, b, c); }
  static Vector less_product(Vector c, Vector a, Vector b) { return _mm256_fnmadd_pd(a, b, c); }
};
#endif

#if defined(__AVX512F__)
struct Avx512Vectors {
  using Vector = double __attribute__((vector_size(64), may_alias));
  static Vector plus_product(Vector c, Vector a, Vector b) { return _mm512_fmadd_pd(a, b, c); }
  static Vector less_product(Vector c, Vector a, Vector b) { return _mm512_fnmadd_pd(a, b, c); }
};
#endif

/// A number for each lane, in `count` hardware vectors. The rows of the banded solve depend on each
/// other, so with two vectors one is computed while the other waits.
template <class Hardware, std::size_t count>
struct LanePack {
  using Vector = typename Hardware::Vector;
  static constexpr std::size_t kLanes = count * sizeof(Vector) / sizeof(double);

  Vector part[count];

  LanePack() = default;
  /// `value` in all lanes.
  inline LanePack(double value) : LanePack(each([&](std::size_t) { return value - Vector{}; })) {}

  template <class Operation>
  static inline LanePack each(const Operation& operation) {
    LanePack result;
    for (std::size_t i = 0; i < count; ++i) {
      result.part[i] = operation(i);
    }
    return result;
  }

  friend inline LanePack operator+(const LanePack& a, const LanePack& b) {
    return each([&](std::size_t i) { return a.part[i] + b.part[i]; });
  }
  friend inline LanePack operator-(const LanePack& a, const LanePack& b) {
    return each([&](std::size_t i) { return a.part[i] - b.part[i]; });
  }
  friend inline LanePack operator*(const LanePack& a, const LanePack& b) {
    return each([&](std::size_t i) { return a.part[i] * b.part[i]; });
  }
  friend inline LanePack operator/(const LanePack& a, const LanePack& b) {
    return each([&](std::size_t i) { return a.part[i] / b.part[i]; });
  }
  inline LanePack& operator+=(const LanePack& b) { return *this = *this + b; }
  inline LanePack& operator-=(const LanePack& b) { return *this = *this - b; }
};

/// plus_product() of element_force.h for packs; c and a may also be numbers.
template <class C, class A, class Hardware, std::size_t count>
inline auto plus_product(const C& c, const A& a, const LanePack<Hardware, count>& b) {
  using Pack = LanePack<Hardware, count>;
  const Pack c_pack = c;
  const Pack a_pack = a;
  return Pack::each([&](std::size_t i) {
    return Hardware::plus_product(c_pack.part[i], a_pack.part[i], b.part[i]);
  });
}

template <class C, class A, class Hardware, std::size_t count>
inline auto less_product(const C& c, const A& a, const LanePack<Hardware, count>& b) {
  using Pack = LanePack<Hardware, count>;
  const Pack c_pack = c;
  const Pack a_pack = a;
  return Pack::each([&](std::size_t i) {
    return Hardware::less_product(c_pack.part[i], a_pack.part[i], b.part[i]);
  });
}

/// Sums the momenta of all links at both ends of a step.
template <class Constant, class Pack>
struct MomentaOfStep {
  LinkMomenta<Constant, Pack> before;
  LinkMomenta<Constant, Pack> after;

  void start(std::size_t row, const PlanarVector<Pack>& v) { before.add(row, v); }
  void end(std::size_t row, const PlanarVector<Pack>& v) { after.add(row, v); }
};

/// pefrl_step() of all lanes. `Pack` is a LanePack; `Constant` is Pack or, if shared, double.
template <class Pack, class Constant>
void step_packs(const ChainTables<Constant>& chain, const PefrlArrays& arrays) {
  const auto packs = [](double* numbers) { return reinterpret_cast<Pack*>(numbers); };
  const Pack* f = packs(arrays.force);
  const AffineContactForce<Pack> force{f[0], f[1], f[2], f[3], f[4], f[5], f[6]};
  Pack* momenta_before = packs(arrays.momenta);
  Pack* momenta_after = momenta_before + 2 * chain.links;
  const Pack* q = packs(arrays.state);
  const Pack* v = q + 2 * chain.rows;
  Pack* q_next = packs(arrays.next);
  Pack* v_next = q_next + 2 * chain.rows;
  const ContactIntegrals<Pack> integrals =
      pefrl_step(chain, force, *packs(arrays.h_s), q, v, q_next, v_next, packs(arrays.scratch),
                 MomentaOfStep<Constant, Pack>{{chain, momenta_before}, {chain, momenta_after}});
  packs(arrays.integrals)[0] = integrals.impulse_n;
  packs(arrays.integrals)[1] = integrals.impulse_t;
  packs(arrays.integrals)[2] = integrals.work_t;
  mean_reactions_squared(chain, momenta_before, momenta_after,
                         {integrals.impulse_t, integrals.impulse_n}, 1.0 / *packs(arrays.h_s),
                         packs(arrays.reactions));
}

template <class Pack>
[[gnu::flatten]] void step_one_chain(const ChainTables<double>& chain, const PefrlArrays& arrays) {
  step_packs<Pack>(chain, arrays);
}

template <class Pack>
[[gnu::flatten]] void step_chains(const LaneTables& chains, const PefrlArrays& arrays) {
  step_packs<Pack>(chains.of<Pack>(), arrays);
}

/// One step of Gauss collocation for the lanes of the LanePack `Pack`. Unknowns are the
/// accelerations of all stages. The simplified Newton method has one tangent per step, at the
/// predicted middle (collocation.md).
template <class Pack>
class CollocationStep {
 public:
  CollocationStep(const GaussCollocation& rule, const CollocationArrays& arrays)
      : rule_(rule),
        arrays_(arrays),
        chain_(arrays.chain.of<Pack>()),
        size_(2 * chain_.rows),
        h_s_(*packs(arrays.h_s)),
        mass_kg_(packs(arrays.mass_kg)),
        stage_q_(packs(arrays.stage_q)),
        stage_a_(packs(arrays.stage_a)) {}

  // Functions of LaneKernel. prepare() predicts from the mean acceleration of the previous step.
  inline void prepare() const;
  inline void iterate() const;
  inline void finish() const;

 private:
  using Vector = PlanarVector<Pack>;
  static constexpr std::size_t kStages = GaussCollocation::kStages;
  static constexpr std::size_t kPairs = GaussCollocation::kPairs;

  /// One entry of the vector of each stage.
  struct Stages {
    inline Stages(const Pack* first, std::size_t stride) {
      for (std::size_t stage = 0; stage < kStages; ++stage) {
        entry[stage] = first[stage * stride];
      }
    }
    inline Pack sum(const double (&weight)[kStages]) const {
      Pack sum = weight[0] * entry[0];
      for (std::size_t stage = 1; stage < kStages; ++stage) {
        sum = plus_product(sum, weight[stage], entry[stage]);
      }
      return sum;
    }
    Pack entry[kStages];
  };

  static Pack* packs(double* numbers) { return reinterpret_cast<Pack*>(numbers); }
  Complex<Pack>* factors() const { return reinterpret_cast<Complex<Pack>*>(arrays_.factors); }

  /// visit(link, rows of the element) for each element along the chain.
  template <class Visit>
  inline void for_each_element(const Visit& visit) const {
    std::size_t row = 0;
    for (std::size_t link = 0; link < chain_.links; ++link) {
      for (std::size_t e = 1; e <= chain_.elements_per_link; ++e) {
        const bool ends_at_joint = e == chain_.elements_per_link && link + 1 < chain_.links;
        const ElementRows at = rows_of_element(row, ends_at_joint);
        visit(link, at);
        row = at.p_j;
      }
    }
  }
  inline void put_residual(const Pack* q, const Pack* a, Pack* residual) const;

  const GaussCollocation& rule_;
  const CollocationArrays& arrays_;
  ChainTables<Pack> chain_;
  std::size_t size_;  ///< entries of a vector
  Pack h_s_;
  Pack* mass_kg_;
  Pack* stage_q_;
  Pack* stage_a_;
};

template <class Pack>
[[gnu::flatten]] void CollocationStep<Pack>::prepare() const {
  const Pack squared_h = h_s_ * h_s_;
  const Pack* q = packs(arrays_.state);
  const Pack* v = q + size_;
  const Pack* mean = v + size_;
  for (std::size_t i = 0; i < size_; ++i) {
    const Pack by_v = h_s_ * v[i];
    const Pack by_mean = 0.5 * (squared_h * mean[i]);
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      const double c = rule_.node[stage];
      stage_a_[stage * size_ + i] = mean[i];
      stage_q_[stage * size_ + i] = q[i] + plus_product(c * by_v, c * c, by_mean);
    }
  }
  const auto middle = [&](std::size_t row) {
    return 0.5 * (pair_at(stage_q_ + (kStages - 1) / 2 * size_, row) +
                  pair_at(stage_q_ + kStages / 2 * size_, row));
  };
  auto* const tangents = reinterpret_cast<TangentBlocks<Pack>*>(arrays_.tangents);
  auto* tangent = tangents;
  for (std::size_t row = 0; row < chain_.rows; ++row) {
    mass_kg_[row] = {};
  }
  for_each_element([&](std::size_t link, const ElementRows& at) {
    const ElementConstants<Pack>& constants = chain_.link[link];
    *tangent++ =
        element_tangent(middle(at.p_i), middle(at.s_i), middle(at.p_j), middle(at.s_j), constants);
    mass_kg_[at.p_i] += constants.m_pp;
    mass_kg_[at.s_i] += constants.m_ss;
    mass_kg_[at.p_j] += constants.m_pp;
    mass_kg_[at.s_j] += constants.m_ss;
  });
  mass_kg_[chain_.tip_row] += *chain_.tip_mass_kg;
  for (std::size_t pair = 0; pair < kPairs; ++pair) {
    factor_fronts(
        chain_, tangents,
        Complex<Pack>{rule_.squared_re[pair] * squared_h, rule_.squared_im[pair] * squared_h},
        factors() + pair * chain_factors(chain_.links, chain_.elements_per_link));
  }
}

/// residual = Q_gravity - dU/dq - M a of a stage.
template <class Pack>
void CollocationStep<Pack>::put_residual(const Pack* q, const Pack* a, Pack* residual) const {
  for (std::size_t row = 0; row < chain_.rows; ++row) {
    put_pair(residual, row, Vector{{}, chain_.weight_N[row]});
  }
  for_each_element([&](std::size_t link, const ElementRows& at) {
    const ElementConstants<Pack>& m = chain_.link[link];
    const ElasticForces<Pack> f = elastic_forces(pair_at(q, at.p_i), pair_at(q, at.s_i),
                                                 pair_at(q, at.p_j), pair_at(q, at.s_j), m);
    const Vector ap_i = pair_at(a, at.p_i);
    const Vector as_i = pair_at(a, at.s_i);
    const Vector ap_j = pair_at(a, at.p_j);
    const Vector as_j = pair_at(a, at.s_j);
    const auto add = [&](std::size_t row, const Vector& force, const Pack& kg_p_i,
                         const Pack& kg_s_i, const Pack& kg_p_j, const Pack& less_kg_s_j) {
      Vector sum = pair_at(residual, row) + force;
      sum = less_product(less_product(sum, kg_p_i, ap_i), kg_s_i, as_i);
      put_pair(residual, row, plus_product(less_product(sum, kg_p_j, ap_j), less_kg_s_j, as_j));
    };
    add(at.p_i, f.pull, m.m_pp, m.m_ps, m.n_pp, m.n_ps);
    add(at.s_i, f.by_d - f.by_t, m.m_ps, m.m_ss, m.n_ps, m.n_ss);
    add(at.p_j, Vector{} - f.pull, m.n_pp, m.n_ps, m.m_pp, m.m_ps);
    Vector on_s_j = pair_at(residual, at.s_j) - (f.by_d + f.by_t);
    on_s_j = plus_product(plus_product(on_s_j, m.n_ps, ap_i), m.n_ss, as_i);
    put_pair(residual, at.s_j, less_product(plus_product(on_s_j, m.m_ps, ap_j), m.m_ss, as_j));
  });
  const std::size_t tip = chain_.tip_row;
  put_pair(residual, tip,
           less_product(pair_at(residual, tip), *chain_.tip_mass_kg, pair_at(a, tip)));
  put_pair(residual, 0, Vector{});
}

template <class Pack>
[[gnu::flatten]] void CollocationStep<Pack>::iterate() const {
  Pack* const work = packs(arrays_.work);
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    const std::size_t first = stage * size_;
    put_residual(stage_q_ + first, stage_a_ + first, work + first);
  }
  for (std::size_t i = 0; i < size_; ++i) {
    const Stages residual(work + i, size_);
    for (std::size_t k = 0; k < kStages; ++k) {
      work[k * size_ + i] = residual.sum(rule_.into[k]);
    }
  }
  solve_fronts<kPairs>(chain_, factors(), work);
  const Pack active = *packs(arrays_.active);
  const Pack squared_h = h_s_ * h_s_;
  Pack squares{};
  for (std::size_t i = 0; i < size_; ++i) {
    Stages w(work + i, size_);
    for (Pack& entry : w.entry) {
      entry = active * entry;
    }
    Pack sum{};
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      const Pack by_q = squared_h * w.sum(rule_.shift[stage]);
      stage_a_[stage * size_ + i] += w.sum(rule_.back[stage]);
      stage_q_[stage * size_ + i] += by_q;
      sum = plus_product(sum, by_q, by_q);
    }
    squares = plus_product(squares, mass_kg_[i / 2], sum);
  }
  *packs(arrays_.squares) = squares;
}

template <class Pack>
[[gnu::flatten]] void CollocationStep<Pack>::finish() const {
  const Pack* state = packs(arrays_.state);
  Pack* next = packs(arrays_.next);
  Pack squares{};
  for (std::size_t i = 0; i < size_; ++i) {
    const Stages a(stage_a_ + i, size_);
    const Pack mean = a.sum(rule_.weight);
    const Pack v = state[size_ + i];
    next[2 * size_ + i] = mean;
    next[size_ + i] = plus_product(v, h_s_, mean);
    next[i] = plus_product(state[i], h_s_, plus_product(v, h_s_, a.sum(rule_.position_weight)));
    const Pack highest = a.sum(rule_.legendre[kStages - 1]);
    const Pack second = a.sum(rule_.legendre[kStages - 2]);
    squares =
        plus_product(squares, mass_kg_[i / 2], plus_product(highest * highest, second, second));
  }
  *packs(arrays_.squares) = (h_s_ * h_s_) * squares;
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
