#pragma once

#include <cstddef>
#include <string_view>

#include "worker/solver/fast/collocation_kernel.h"
#include "worker/solver/fast/kernels.h"
#include "worker/solver/fast/lane_pack.h"
#include "worker/solver/reference/pefrl.h"

namespace oblique::solver {

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
