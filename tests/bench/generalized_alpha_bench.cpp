#include <benchmark/benchmark.h>

#include <memory>
#include <utility>

#include "worker/solver/reference/contact.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/generalized_alpha.h"

namespace oblique::solver {
namespace {

/// Steps of the reference way in the contact (H, mu, e*) = (1, 0.4, 1), by elements a link: the
/// first 20 us after touch, over and over, without the search for events. The cost of a step must
/// grow as the number of elements.
void generalized_alpha_step_in_contact(benchmark::State& bench) {
  ModelParameters model = solver::preset("paper");
  model.elements_per_link = static_cast<int>(bench.range(0));
  const auto owned = std::make_shared<GeneralizedAlphaMotion>(model);
  const GeneralizedAlphaMotion& motion = *owned;
  ChainState touch = solve_stepped_fall(owned, 1e-4, 10.0)->state_at(1.0);
  const Contact contact({model.k_N_m, model.eta2, 0.4, 1.0}, motion.tip(touch), {1e-7, 1e-7});
  const auto force = contact.force();
  motion.restart(force, touch);
  constexpr int kSteps = 200;
  ChainState state = touch;
  ChainState next = touch;
  int step = 0;
  for (auto _ : bench) {
    motion.step(state, force, 1e-7, next);
    std::swap(state, next);
    if (++step == kSteps) {
      state = touch;
      step = 0;
    }
  }
  bench.counters["steps/s"] =
      benchmark::Counter(static_cast<double>(bench.iterations()), benchmark::Counter::kIsRate);
  bench.SetComplexityN(bench.range(0));
}
BENCHMARK(generalized_alpha_step_in_contact)->Arg(4)->Arg(16)->Arg(64)->Complexity(benchmark::oN);

}  // namespace
}  // namespace oblique::solver
