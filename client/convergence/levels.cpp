#include "client/convergence/convergence.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <future>
#include <mutex>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/fall_cache.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/solve.h"
#include "worker/solver/step_choice.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;

/// Whether the fall chooses its steps by the tolerance and has none to halve.
bool falls_by_accuracy(const solver::ModelParameters& model) {
  return model.integrator == solver::Integrator::kExplicit && model.dt_fall_s == 0.0;
}

SolvedLevel solved_level(const Level& level, const ContactPoint& point, solver::FallCache& falls,
                         StatusLine& line) {
  const auto started = Clock::now();
  solver::FallOutcome fall;
  {
    const auto falling = line.begin(level.name + ": fall");
    fall = falls.fall(level.model);
  }
  if (!fall.fallen) {
    throw solver::SolveError(fall.error);
  }
  const auto touching = line.begin(level.name + ": contact");
  const solver::Finger finger(level.model, fall.fallen);
  SolvedLevel solved{level, finger.solve(point.H_m, point.mu, point.e_star)};
  solved.wall_s = std::chrono::duration<double>(Clock::now() - started).count();
  return solved;
}

}  // namespace

std::vector<Level> mesh_levels(const solver::ModelParameters& model, int coarsest, int finest) {
  std::vector<Level> levels;
  int n = coarsest;
  for (; n <= finest; n *= 2) {
    Level level{fmt::format("n = {}", n), model};
    level.model.elements_per_link = n;
    solver::validate(level.model);
    if (model.integrator == solver::Integrator::kExplicit) {
      level.model.dt_s = 0.0;
      level.model.dt_fall_s = 0.0;
    }
    levels.push_back(std::move(level));
  }
  constexpr std::size_t kFewest = 3;  // for an order
  if (levels.size() < kFewest || n != 2 * finest) {
    throw solver::InputError(fmt::format(
        "--finest {} is not allowed: it must be 4, 8, 16, ... times the {} elements a link of "
        "the coarsest mesh",
        finest, coarsest));
  }
  return levels;
}

std::vector<Level> step_levels(const solver::ModelParameters& model, double e_star, int halvings) {
  const solver::Chain chain(model);
  const solver::StepChoice steps(chain, model);
  std::vector<Level> levels;
  for (int i = 0; i <= halvings; ++i) {
    Level level{i == 0 ? "dt" : fmt::format("dt/{:.0f}", std::exp2(i)), model};
    level.model.dt_s = std::ldexp(steps.contact(e_star).restitution_s, -i);
    if (!falls_by_accuracy(model)) {
      level.model.dt_fall_s = std::ldexp(steps.fall_s(), -i);
    }
    levels.push_back(std::move(level));
  }
  return levels;
}

std::optional<Level> exact_fall_level(const Level& level) {
  constexpr double kPart = 0.1;
  constexpr double kTightest = 1e-9;  // that models may have
  if (!falls_by_accuracy(level.model)) {
    return std::nullopt;
  }
  Level exact{"exact fall", level.model};
  const double solved_for = std::min(level.model.tolerance, solver::ModelParameters().tolerance);
  exact.model.tolerance = std::max(kPart * solved_for, kTightest);
  return exact;
}

std::vector<SolvedLevel> solve_levels(const std::vector<Level>& levels, const ContactPoint& point,
                                      StatusLine& line,
                                      const std::function<void(const SolvedLevel&)>& after_each) {
  solver::FallCache falls;
  std::mutex reporting;
  std::vector<std::future<SolvedLevel>> running;
  for (const auto& level : levels) {
    running.push_back(std::async(std::launch::async, [&] {
      auto solved = solved_level(level, point, falls, line);
      const std::lock_guard lock(reporting);
      after_each(solved);
      return solved;
    }));
  }
  std::vector<SolvedLevel> solved;
  for (auto& level : running) {
    solved.push_back(level.get());
  }
  return solved;
}

}  // namespace oblique::client
