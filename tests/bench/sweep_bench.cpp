#include <benchmark/benchmark.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "worker/solver/fall_cache.h"
#include "worker/solver/falls.h"
#include "worker/solver/fast/kernels.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/solve_contact.h"
#include "worker/solver/solve.h"
#include "worker/solver/step_choice.h"

namespace oblique::bench {
namespace {

using solver::Chain;
using solver::Finger;
using solver::FingerPoint;
using solver::ModelParameters;
using solver::Point;

/// Returns a grid of 8 drops, 8 frictions and 8 restitutions.
std::vector<Point> sweep() {
  std::vector<Point> points;
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) {
      for (int k = 0; k < 8; ++k) {
        points.push_back({0.1 + 0.15 * i, 0.05 + 0.13 * j, 0.2 + 0.8 * k / 7.0});
      }
    }
  }
  return points;
}

ModelParameters with_elements(std::int64_t elements_per_link) {
  ModelParameters model = solver::preset("paper");
  model.elements_per_link = static_cast<int>(elements_per_link);
  return model;
}

void count_cases(benchmark::State& bench, std::size_t cases_an_iteration) {
  bench.counters["cases/s"] = benchmark::Counter(
      static_cast<double>(bench.iterations()) * static_cast<double>(cases_an_iteration),
      benchmark::Counter::kIsRate);
}

/// Solves one contact without vector lanes.
void solve_scalar(const Chain& chain, const solver::Fall& fall, const solver::StepChoice& steps,
                  const Point& point) {
  const solver::ExplicitMotion motion(chain);
  const ModelParameters model = solver::preset("paper");
  benchmark::DoNotOptimize(
      solver::solve_contact(motion, {model.k_N_m, model.eta2, point.mu, point.e_star},
                            steps.contact(point.e_star), fall.state_at(point.H_m), {}));
}

/// Solves every point as a simple script would: with its own model and fall, without vector lanes.
void naive(benchmark::State& bench) {
  const std::vector<Point> points = sweep();
  std::size_t next = 0;
  for (auto _ : bench) {
    const ModelParameters model = solver::preset("paper");
    const Chain chain(model);
    const solver::StepChoice steps(chain, model);
    const auto fall = solver::solve_stepped_fall(chain, steps.fall_s());
    solve_scalar(chain, *fall, steps, points[next]);
    next = (next + 37) % points.size();  // a stride that scatters successive points over the grid
  }
  count_cases(bench, 1);
}
BENCHMARK(naive)->Unit(benchmark::kMillisecond);

/// Solves one fall, and then the contacts of all points without vector lanes.
void shared_fall(benchmark::State& bench) {
  const ModelParameters model = with_elements(bench.range(0));
  const Chain chain(model);
  const solver::StepChoice steps(chain, model);
  const auto fall = solver::solve_stepped_fall(chain, steps.fall_s());
  const std::vector<Point> points = sweep();
  std::size_t next = 0;
  for (auto _ : bench) {
    solve_scalar(chain, *fall, steps, points[next]);
    next = (next + 37) % points.size();
  }
  count_cases(bench, 1);
}
BENCHMARK(shared_fall)->Arg(4)->Arg(16)->Unit(benchmark::kMicrosecond);

/// Solves one fall, and then the contacts of all points on vector lanes. The second argument is the
/// number of threads.
void lanes_and_threads(benchmark::State& bench) {
  const Finger finger(with_elements(bench.range(0)));
  const auto threads = static_cast<std::size_t>(bench.range(1));
  const std::vector<Point> points = sweep();
  finger.largest_drop_m();  // solves the fall before the measurement
  for (auto _ : bench) {
    std::atomic<std::size_t> next{0};
    std::vector<std::jthread> workers;
    for (std::size_t i = 0; i < threads; ++i) {
      workers.emplace_back([&] {
        solver::solve_points(
            [&]() -> std::optional<FingerPoint> {
              const std::size_t index = next++;
              return index < points.size()
                         ? std::optional(FingerPoint{finger, index, points[index]})
                         : std::nullopt;
            },
            [](solver::Outcome&& outcome) { benchmark::DoNotOptimize(outcome); });
      });
    }
  }
  count_cases(bench, points.size());
}
BENCHMARK(lanes_and_threads)
    ->ArgNames({"n", "threads"})
    ->ArgsProduct({{4, 8, 16, 32}, {1}})
    ->Args({4, 2})
    ->Args({4, 4})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// Solves `count` points, given by `point_at`, as a thread of a worker does.
void solve_all(std::size_t count, const std::function<FingerPoint(std::size_t)>& point_at) {
  std::size_t next = 0;
  solver::solve_points(
      [&]() -> std::optional<FingerPoint> {
        return next < count ? std::optional(point_at(next++)) : std::nullopt;
      },
      [](solver::Outcome&& outcome) {
        if (!outcome.result) {
          throw std::runtime_error(outcome.error);
        }
        benchmark::DoNotOptimize(outcome);
      });
}

/// Points that differ in k and eta2 but share one fall. They have 1 or 8 different drops H.
void distinct_contacts(benchmark::State& bench) {
  const ModelParameters model = solver::preset("paper");
  const auto fallen = solver::solve_falls({&model, 1}).front().fallen;
  const auto drops = static_cast<std::size_t>(bench.range(0));
  constexpr std::size_t kCases = 512;
  for (auto _ : bench) {
    solve_all(kCases, [&](std::size_t i) {
      const double part = static_cast<double>(i) / kCases;
      ModelParameters mine = model;
      mine.k_N_m *= 0.5 + part;
      mine.eta2 *= 1.0 + 0.3 * part;
      const double H_m = 0.3 + 0.1 * static_cast<double>(i % drops);
      return FingerPoint{Finger(mine, fallen), i, {H_m, 0.05 + part, 1.0 - 0.6 * part}};
    });
  }
  count_cases(bench, kCases);
}
BENCHMARK(distinct_contacts)->ArgName("drops")->Arg(1)->Arg(8)->Unit(benchmark::kMillisecond);

/// Points that differ in E, I and lengths, so that each needs its own fall. There are twice as many
/// points as vector lanes.
void distinct_chains(benchmark::State& bench) {
  const std::size_t cases = 2 * solver::runnable_lane_kernels().front().lanes;
  int round = 0;
  for (auto _ : bench) {
    ++round;
    std::vector<ModelParameters> models(cases, with_elements(bench.range(0)));
    for (std::size_t i = 0; i < cases; ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(cases);
      models[i].E_Pa *= 0.8 + 0.4 * part + 1e-6 * round;
      models[i].I_m4 *= 1.1 - 0.2 * part;
      models[i].lengths_m[1] *= 0.9 + 0.2 * part;
    }
    solver::FallCache falls;
    solve_all(cases, [&](std::size_t i) {
      const auto fallen = falls.fall(models[i], std::span(models).subspan(i)).fallen;
      return FingerPoint{Finger(models[i], fallen), i, {0.8, 0.4, 0.9}};
    });
  }
  count_cases(bench, cases);
}
BENCHMARK(distinct_chains)->ArgName("n")->Arg(4)->Arg(16)->Unit(benchmark::kMillisecond);

/// Solves one point of a model whose fall is not cached.
void fresh_point(benchmark::State& bench) {
  for (auto _ : bench) {
    benchmark::DoNotOptimize(Finger(with_elements(bench.range(0))).solve(1.0, 0.4, 1.0));
  }
  count_cases(bench, 1);
}
BENCHMARK(fresh_point)->ArgName("n")->Arg(4)->Arg(16)->Arg(32)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace oblique::bench
