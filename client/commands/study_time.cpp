#include "client/commands/study_time.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/system/resources.h"
#include "worker/solver/estimate.h"
#include "worker/solver/falls.h"
#include "worker/solver/fast/kernels.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/parallel_for.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;
using solver::FingerPoint;
using solver::ModelParameters;

/// Calls `work` with each number below `count` on its own thread. Returns the total time [s].
double thread_seconds(std::size_t count, const std::function<void(std::size_t)>& work) {
  std::vector<double> each_s(count);
  solver::parallel_for(count, count, [&](std::size_t i) {
    const auto start = Clock::now();
    work(i);
    each_s[i] = std::chrono::duration<double>(Clock::now() - start).count();
  });
  return std::accumulate(each_s.begin(), each_s.end(), 0.0);
}

/// Returns each example and up to seven points after it. Some of these share the fall of the
/// example, so that points are solved together as in a real study.
std::vector<FingerPoint> points_over(solver::FallCache& falls, const protocol::PointTable& table,
                                     const protocol::StudySize& size) {
  constexpr std::uint64_t kNeighbours = 8;
  std::vector<FingerPoint> points;
  for (const std::uint64_t example : size.examples) {
    for (auto i = example; i < std::min(example + kNeighbours, table.size()); ++i) {
      const protocol::Point point = table.point(i);
      const ModelParameters model = table.model(point.model);
      const auto fall = falls.kept_fall(model);
      if (fall && fall->fallen && table.passes_filter(i)) {
        points.push_back(
            {solver::Finger(model, fall->fallen), i, {point.H_m, point.mu, point.e_star}});
      }
    }
  }
  return points;
}

/// Axes that change the fall.
struct FallAxes {
  std::set<std::string> drawn;  ///< keys with a distribution
  double other_values = 1.0;    ///< combinations of the values of keys without a distribution
};

FallAxes fall_axes(const protocol::Recipe& recipe) {
  FallAxes found;
  const ModelParameters model = protocol::from_message(recipe.model());
  for (const auto& block : recipe.blocks()) {
    for (const auto* axis : protocol::fall_axes(model, block)) {
      if (axis->has_distribution()) {
        found.drawn.insert(axis->key());
      } else {
        found.other_values *= static_cast<double>(protocol::axis_size(*axis));
      }
    }
  }
  return found;
}

double falls_time_s(const StudyCost& cost, double falls) {
  const double rounds = std::ceil(falls / static_cast<double>(cost.falls_at_once));
  return std::ceil(rounds / static_cast<double>(cost.threads)) * cost.falls_s;
}

}  // namespace

StudyCost measured_cost(const protocol::PointTable& table, const protocol::StudySize& size) {
  StudyCost cost;
  cost.threads = protocol::usable_processors().count;
  std::set<std::uint64_t> different;
  std::vector<ModelParameters> models;  // models with different falls
  for (const std::uint64_t example : size.examples) {
    const ModelParameters model = table.model(table.point(example).model);
    const bool in_lanes = solver::fall_side_by_side(model, model);
    cost.falls_at_once = in_lanes ? solver::runnable_lane_kernels().front().lanes : 1;
    if (models.size() < cost.threads * cost.falls_at_once &&
        different.insert(solver::fall_hash(model)).second) {
      models.push_back(model);
    }
  }
  solver::FallCache falls;
  const std::size_t rounds = (models.size() + cost.falls_at_once - 1) / cost.falls_at_once;
  const double falls_s = thread_seconds(rounds, [&](std::size_t round) {
    std::vector<ModelParameters> some;
    for (std::size_t i = round; i < models.size(); i += rounds) {
      some.push_back(models[i]);
    }
    falls.falls(some);
    if (table.wants_errors()) {
      std::transform(some.begin(), some.end(), some.begin(), solver::companion_model);
      falls.falls(some);
    }
  });
  cost.falls_s = falls_s / static_cast<double>(rounds);
  cost.timed_falls = models.size() * (table.wants_errors() ? 2 : 1);

  const std::vector<FingerPoint> points = points_over(falls, table, size);
  std::vector<std::size_t> begun(cost.threads);
  const double contacts_s = thread_seconds(cost.threads, [&](std::size_t thread) {
    // A batch ends after this time, as in a worker, but has at least one point per lane.
    constexpr std::chrono::milliseconds kBatch{100};
    std::size_t& i = begun[thread];
    for (const auto start = Clock::now();
         i < points.size() && Clock::now() < start + std::chrono::seconds(1);) {
      const auto late = Clock::now() + kBatch;
      const std::size_t fewest = i + cost.falls_at_once;
      const auto next = [&]() -> std::optional<FingerPoint> {
        if (i == points.size() || (i >= fewest && Clock::now() > late)) {
          return std::nullopt;
        }
        return points[(thread * points.size() / cost.threads + i++) % points.size()];
      };
      const auto drop = [](solver::Outcome&&) {};
      if (table.wants_errors()) {
        solver::solve_points_with_errors(next, falls, drop);
      } else {
        solver::solve_points(next, drop);
      }
    }
  });
  cost.timed_points = std::accumulate(begun.begin(), begun.end(), std::size_t{0});
  constexpr double kStored_s = 15e-6;  // processor time for messages and storage
  cost.contact_s =
      contacts_s / static_cast<double>(std::max<std::size_t>(cost.timed_points, 1)) + kStored_s;
  return cost;
}

double time_s(const StudyCost& cost, const protocol::StudySize& size) {
  return falls_time_s(cost, static_cast<double>(size.falls)) +
         static_cast<double>(size.points) * cost.contact_s / static_cast<double>(cost.threads);
}

std::string time_in_words(const StudyCost& cost, const protocol::StudySize& size,
                          const protocol::Recipe& recipe) {
  const double all_s = time_s(cost, size);
  const double falls_s = falls_time_s(cost, static_cast<double>(size.falls));
  std::string words = fmt::format("about {} on {} {}", format_duration(all_s), cost.threads,
                                  cost.threads == 1 ? "thread" : "threads");
  if (size.falls == 1 || falls_s < all_s / 2.0) {
    return words;
  }
  words += fmt::format(
      ": {:.0f} % of it for {} falls.\n        Points that differ only in H, mu, e, k and eta2 "
      "share one fall",
      100.0 * falls_s / all_s, format_count(size.falls));
  const auto& [keys, other_values] = fall_axes(recipe);
  const int count = keys.size() < 2 ? 16 : keys.size() == 2 ? 8 : 4;
  const double falls = other_values * std::pow(count, static_cast<double>(keys.size()));
  if (keys.empty() || falls > static_cast<double>(size.falls) / 2.0) {
    return words;
  }
  return words + fmt::format("; {} with count = {}{}: about {}", fmt::join(keys, ", "), count,
                             keys.size() == 1 ? "" : " each",
                             format_duration(all_s - falls_s + falls_time_s(cost, falls)));
}

}  // namespace oblique::client
