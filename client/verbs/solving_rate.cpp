#include "client/verbs/solving_rate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "proto/recipe/model_message.h"
#include "proto/recipe/sampling/sobol.h"
#include "worker/point_solver.h"
#include "worker/solver/model/fall_model.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Neighbours that are solved together: a few for every lane.
constexpr std::uint64_t kTogether = 32;

std::uint64_t batches_of(const protocol::PointTable& points) {
  return (points.size() + kTogether - 1) / kTogether;
}

/// Neighbours from the part of the study that the sequence 0, 1/2, 3/4, 1/4, ... comes to next.
worker::Batch batch_number(std::uint64_t number,
                           const std::shared_ptr<const protocol::PointTable>& points) {
  const double part = static_cast<double>(sampling::sobol_bits(number, 0)) * 0x1p-52;
  const std::uint64_t batches = batches_of(*points);
  const auto batch = static_cast<std::uint64_t>(part * static_cast<double>(batches));
  const std::uint64_t first = std::min(batch, batches - 1) * kTogether;
  return {number, 0, {{first, std::min(first + kTogether, points->size())}}, points};
}

/// Falls that are solved already, by model.
using KnownFalls = std::vector<std::pair<solver::ModelParameters, solver::FallOutcome>>;

/// What one thread solves.
class Sample {
 public:
  /// `known` are falls that cost nothing any more; it must not change while this solves.
  explicit Sample(const std::shared_ptr<const protocol::PointTable>& points,
                  const KnownFalls& known = {})
      : points_(points),
        known_(known),
        solver_({}, [this](auto models) { return falls(models); }) {}

  /// Solves the first point that there is, with its falls.
  void solve_one(Clock::time_point end) {
    const auto start = Clock::now();
    const std::uint64_t first = points_->first_left_in(0, points_->size());
    solve({0, 0, {{first, first + 1}}, points_}, end);
    rate_.points_s = seconds_since(start) - rate_.falls_s;
  }

  /// Solves batch `first`, then each `stride`-th one, until the time is over. What is under way
  /// then is finished.
  void solve(std::uint64_t first, std::uint64_t stride, Clock::time_point end) {
    const auto start = Clock::now();
    for (std::uint64_t number = first; number < batches_of(*points_); number += stride) {
      solve(batch_number(number, points_), end);
      if (Clock::now() >= end) {
        break;
      }
    }
    rate_.points_s = seconds_since(start) - rate_.falls_s;
  }

  const SolvingRate& rate() const { return rate_; }
  /// With what it solved itself.
  const KnownFalls& known() const { return known_; }

 private:
  std::vector<solver::FallOutcome> falls(std::span<const solver::ModelParameters> models) {
    std::vector<solver::FallOutcome> outcomes(models.size());
    std::vector<solver::ModelParameters> missing;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < models.size(); ++i) {
      const auto found = std::find_if(known_.begin(), known_.end(), [&](const auto& fall) {
        return fall.first == solver::fall_model(models[i]);
      });
      if (found != known_.end()) {
        outcomes[i] = found->second;
      } else {
        missing.push_back(models[i]);
        places.push_back(i);
      }
    }
    const auto start = Clock::now();
    auto solved = solver::solve_falls(missing);
    rate_.falls += missing.size();
    rate_.falls_s += seconds_since(start);
    for (std::size_t i = 0; i < missing.size(); ++i) {
      if (known_.size() < kMostKnown) {
        known_.emplace_back(solver::fall_model(missing[i]), solved[i]);
      }
      outcomes[places[i]] = std::move(solved[i]);
    }
    return outcomes;
  }

  void solve(const worker::Batch& batch, Clock::time_point end) {
    constexpr std::uint64_t kFewest = 4;
    std::uint64_t next = 0;
    std::uint64_t given = 0;
    solver_.solve(
        batch,
        [&]() -> std::optional<std::uint64_t> {
          next = batch.first_to_solve(next, batch.size());
          if (next >= batch.size() || (given >= kFewest && Clock::now() >= end)) {
            return std::nullopt;
          }
          ++given;
          return next++;
        },
        [this](protocol::PointResult&&) { ++rate_.points; });
  }

  static constexpr std::size_t kMostKnown = 16;

  const std::shared_ptr<const protocol::PointTable>& points_;
  KnownFalls known_;
  SolvingRate rate_;
  worker::PointSolver solver_;
};

/// What `threads` threads solve in `budget_s`. The first point is solved before, so that its fall
/// is not solved by each.
SolvingRate rate_of(const std::shared_ptr<const protocol::PointTable>& points, double budget_s) {
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(budget_s));
  std::vector<std::unique_ptr<Sample>> samples;
  samples.push_back(std::make_unique<Sample>(points));
  samples.front()->solve_one(end);
  if (points->points() > 1) {
    const std::uint64_t threads = std::min<std::uint64_t>(cores, batches_of(*points));
    std::vector<std::jthread> at_work;
    for (std::uint64_t i = 0; i < threads; ++i) {
      auto& sample =
          *samples.emplace_back(std::make_unique<Sample>(points, samples.front()->known()));
      at_work.emplace_back([&sample, i, threads, end] { sample.solve(i, threads, end); });
    }
  }
  SolvingRate total;
  total.threads = cores;
  for (const auto& sample : samples) {
    total.points += sample->rate().points;
    total.points_s += sample->rate().points_s;
    total.falls += sample->rate().falls;
    total.falls_s += sample->rate().falls_s;
  }
  return total;
}

int elements_of(const protocol::Recipe& recipe) {
  return protocol::from_message(recipe.model()).elements_per_link;
}

/// The elements a link of a mesh that can be tried in part of a second, twice as many as of the
/// coarser one beside it; 0 where the recipe's own can, or several meshes are asked for.
int trial_elements(const protocol::Recipe& recipe) {
  constexpr std::size_t kElements = 48;  // of all links
  constexpr std::string_view kKey = "elements_per_link";
  for (const auto& block : recipe.blocks()) {
    for (const auto& axis : block.axes()) {
      if (axis.key() == kKey || axis.key() == "links") {
        return 0;
      }
    }
  }
  const auto links = protocol::from_message(recipe.model()).lengths_m.size();
  const auto few = static_cast<int>(std::max<std::size_t>(1, kElements / links / 2));
  return elements_of(recipe) > 2 * few ? 2 * few : 0;
}

std::shared_ptr<const protocol::PointTable> on_mesh(protocol::Recipe recipe, int elements) {
  auto model = protocol::from_message(recipe.model());
  model.elements_per_link = elements;
  model.dt_fall_s = 0.0;  // each mesh's own
  *recipe.mutable_model() = protocol::to_message(model);
  return std::make_shared<const protocol::PointTable>(std::move(recipe));
}

/// How much more one costs on a mesh `finer` times as fine as that on which `count` took `time_s`,
/// by the power of the elements that they cost more than on half of them.
double extrapolated(double coarse_s, std::uint64_t coarse_count, double time_s, std::uint64_t count,
                    double finer) {
  constexpr double kLeastPower = 1.0;    // work a step grows with the elements,
  constexpr double kLargestPower = 3.0;  // steps with their square at most
  if (coarse_count == 0 || count == 0 || !(coarse_s > 0.0) || !(time_s > 0.0)) {
    return 1.0;
  }
  const double ratio =
      time_s / static_cast<double>(count) / (coarse_s / static_cast<double>(coarse_count));
  return std::pow(finer, std::clamp(std::log2(ratio), kLeastPower, kLargestPower));
}

}  // namespace

double SolvingRate::time_s(std::uint64_t all_points, std::uint64_t all_falls) const {
  const auto each = [](double total_s, std::uint64_t count) {
    return count == 0 ? 0.0 : total_s / static_cast<double>(count);
  };
  // A fall is solved by one thread, and points wait for theirs.
  const auto side_by_side = static_cast<double>(threads);
  const double falls_a_thread =
      all_falls == 0 ? 0.0 : std::max(static_cast<double>(all_falls) / side_by_side, 1.0);
  return static_cast<double>(all_points) / side_by_side * each(points_s, points) +
         falls_a_thread * each(falls_s, falls);
}

SolvingRate measured_rate(const std::shared_ptr<const protocol::PointTable>& points,
                          double budget_s) {
  const int elements = trial_elements(points->recipe());
  if (elements == 0) {
    return rate_of(points, budget_s);
  }
  const auto coarse = rate_of(on_mesh(points->recipe(), elements / 2), budget_s / 4);
  auto rate = rate_of(on_mesh(points->recipe(), elements), budget_s / 2);
  const double finer =
      static_cast<double>(elements_of(points->recipe())) / static_cast<double>(elements);
  rate.points_s *= extrapolated(coarse.points_s, coarse.points, rate.points_s, rate.points, finer);
  rate.falls_s *= extrapolated(coarse.falls_s, coarse.falls, rate.falls_s, rate.falls, finer);
  rate.elements_per_link = elements;
  return rate;
}

}  // namespace oblique::client
