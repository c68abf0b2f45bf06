#include "client/convergence/levels.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/convergence/parallel.h"
#include "worker/solver/chain/chain.h"
#include "worker/solver/falls.h"
#include "worker/solver/solve.h"
#include "worker/solver/step_choice.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;
using solver::CaseResult;

/// Whether the fall chooses its steps by the tolerance and has none to halve.
bool falls_by_accuracy(const solver::ModelParameters& model) {
  return model.integrator == solver::Integrator::kExplicit && model.dt_fall_s == 0.0;
}

// Long computations begin first, so that no core is left alone with one at the end.
std::vector<std::size_t> dearest_first(const std::vector<Level>& levels) {
  std::vector<std::size_t> turns(levels.size());
  std::iota(turns.rbegin(), turns.rend(), std::size_t{0});
  std::stable_sort(turns.begin(), turns.end(), [&](std::size_t a, std::size_t b) {
    return levels[a].model.elements_per_link > levels[b].model.elements_per_link;
  });
  return turns;
}

/// The falls of some levels, each solved when it is first asked for. From any thread; who asks for
/// one that another thread solves waits for it.
class FallsOfLevels {
 public:
  /// Over the fall that the level shares with others. Throws what the solver throws.
  solver::Finger finger(const Level& level, WorkLine& line) {
    Entry& entry = entry_of(level.model);
    const auto falling = line.begin([&level, &chain = *entry.chain] {
      return fmt::format("{}: {}", level.name,
                         fall_so_far(level.model, chain.fall_progress().drop_m()));
    });
    std::call_once(entry.once, [&entry] {
      entry.fall = solver::solve_falls({&entry.chain, 1}).front();
    });
    if (!entry.fall.fallen) {
      throw solver::SolveError(entry.fall.error);
    }
    return {level.model, entry.fall.fallen};
  }

 private:
  struct Entry {
    explicit Entry(const solver::ModelParameters& model)
        : chain(std::make_shared<const solver::PreparedChain>(model)) {}
    std::shared_ptr<const solver::PreparedChain> chain;
    std::once_flag once;
    solver::FallOutcome fall;
  };

  Entry& entry_of(const solver::ModelParameters& model) {
    const std::lock_guard lock(mutex_);
    const auto falling = solver::fall_model(model);
    const auto known = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
      return entry.chain->model() == falling;
    });
    return known == entries_.end() ? entries_.emplace_back(model) : *known;
  }

  std::mutex mutex_;
  std::list<Entry> entries_;
};

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
  if (!falls_by_accuracy(level.model)) {
    return std::nullopt;
  }
  Level exact{"exact fall", level.model};
  const double solved_for = std::min(level.model.tolerance, solver::ModelParameters().tolerance);
  exact.model.tolerance = std::max(kExactFall * solved_for, kTightestFall);
  return exact;
}

std::vector<SolvedLevel> solve_levels(const std::vector<Level>& levels,
                                      const std::vector<ContactPoint>& points, WorkLine& line,
                                      const std::function<void(const SolvedLevel&)>& after_each) {
  std::vector<SolvedLevel> solved(levels.size());
  const auto turns = dearest_first(levels);
  FallsOfLevels falls;
  std::mutex telling;
  for_each_in_parallel(levels.size(), [&](std::size_t turn) {
    const auto started = Clock::now();
    auto& mine = solved[turns[turn]];
    mine.level = levels[turns[turn]];
    const auto finger = falls.finger(mine.level, line);
    const auto touching = line.begin(mine.level.name + ": contact");
    mine.results = contacts_of(finger, points);
    mine.wall_s = std::chrono::duration<double>(Clock::now() - started).count();
    const std::lock_guard lock(telling);
    after_each(mine);
  });
  return solved;
}

std::vector<CaseResult> contacts_of(const solver::Finger& finger,
                                    const std::vector<ContactPoint>& points) {
  std::vector<CaseResult> results(points.size());
  std::size_t next = 0;
  std::size_t failed = points.size();
  finger.solve_points(
      [&]() -> std::optional<solver::PointRequest> {
        if (next == points.size()) {
          return std::nullopt;
        }
        const auto& point = points[next];
        return solver::PointRequest{next++, point.H_m, point.mu, point.e_star};
      },
      [&](solver::PointOutcome&& outcome) {
        if (outcome.result) {
          results[outcome.number] = std::move(*outcome.result);
        } else {
          failed = std::min<std::size_t>(failed, outcome.number);
        }
      });
  if (failed < points.size()) {
    results[failed] = finger.solve(points[failed].H_m, points[failed].mu, points[failed].e_star);
  }
  return results;
}

}  // namespace oblique::client
