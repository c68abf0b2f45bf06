#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/bench/counted_number.h"
#include "tests/bench/multiply_add_peak.h"
#include "worker/solver/fast/lane_stepper.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/pefrl.h"

namespace oblique::bench {
namespace {

using solver::Chain;
using solver::LaneKernel;

/// Floating-point operations of one evaluation of the accelerations with its kick and drift: a
/// quarter of a PEFRL step.
double operations_an_evaluation(const Chain& chain) {
  std::vector<CountedNumber> state(2 * chain.tables().rows);
  std::vector<CountedNumber> q = state;
  std::vector<CountedNumber> v = state;
  std::vector<CountedNumber> scratch = state;
  const std::uint64_t before = CountedNumber::operations();
  solver::pefrl_step<double, CountedNumber>(chain.tables(), {}, CountedNumber(1e-6), state.data(),
                                            state.data(), q.data(), v.data(), scratch.data());
  return static_cast<double>(CountedNumber::operations() - before) / solver::Pefrl::kKicks;
}

/// Steps of full lanes, without the contact law: ns an evaluation of one lane, and the share of the
/// multiply-add peak that this core has shown just before with the same vectors. With `own_chains`
/// each lane has constants of its own.
void lane_step(benchmark::State& bench, const LaneKernel& kernel, int elements_per_link,
               bool own_chains) {
  std::vector<Chain> chains;
  for (std::size_t lane = 0; lane < kernel.lanes; ++lane) {
    solver::ModelParameters model = solver::preset("paper");
    model.elements_per_link = elements_per_link;
    model.E_Pa *= own_chains ? 1.0 + 0.01 * static_cast<double>(lane) : 1.0;
    chains.emplace_back(model);
  }
  solver::LaneStepper stepper(chains[0].tables(), kernel);
  for (std::size_t lane = 0; lane < kernel.lanes; ++lane) {
    const Chain& chain = own_chains ? chains[lane] : chains[0];
    const solver::ChainState rest = chain.at_rest();
    stepper.load(lane, chain.tables(), rest.q.data(), rest.v.data());
    stepper.set_step(lane,
                     0.2 * solver::Pefrl::stability_limit() / chain.highest_frequency_rad_s(0.0));
  }
  const std::vector<unsigned char> accept(kernel.lanes, 1);
  const double peak_per_s = multiply_add_peak_per_s(kernel.name);
  for (auto _ : bench) {
    stepper.step();
    stepper.settle(accept);
  }
  const double evaluations = static_cast<double>(bench.iterations()) *
                             static_cast<double>(solver::Pefrl::kKicks * kernel.lanes);
  const double operations = operations_an_evaluation(chains[0]);
  using benchmark::Counter;
  bench.counters["s/evaluation"] = Counter(evaluations, Counter::kIsRate | Counter::kInvert);
  bench.counters["operations"] = operations;
  bench.counters["peak_share"] = Counter(evaluations * operations / peak_per_s, Counter::kIsRate);
}

[[maybe_unused]] const bool registered = [] {
  for (const LaneKernel& kernel : solver::runnable_lane_kernels()) {
    for (const int n : {4, 8, 16, 32}) {
      for (const bool own_chains : {false, true}) {
        const std::string name = "lane_step/" + std::string(kernel.name) + "/" + std::to_string(n) +
                                 (own_chains ? "/own_chains" : "");
        benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& bench) {
          lane_step(bench, kernel, n, own_chains);
        });
      }
    }
  }
  return true;
}();

}  // namespace
}  // namespace oblique::bench
