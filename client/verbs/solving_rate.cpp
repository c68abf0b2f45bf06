#include "client/verbs/solving_rate.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "proto/recipe/sampling/sobol.h"
#include "worker/point_solver.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Neighbours that are solved together: a few for every lane.
constexpr std::uint64_t kTogether = 32;

/// Neighbours from the part of the study that the sequence 0, 1/2, 3/4, 1/4, ... comes to next.
worker::Batch batch_number(std::uint64_t number,
                           const std::shared_ptr<const protocol::PointTable>& points) {
  const double part = static_cast<double>(sampling::sobol_bits(number, 0)) * 0x1p-52;
  const std::uint64_t batches = (points->size() + kTogether - 1) / kTogether;
  const auto batch = static_cast<std::uint64_t>(part * static_cast<double>(batches));
  const std::uint64_t first = std::min(batch, batches - 1) * kTogether;
  return {number, 0, first, std::min(kTogether, points->size() - first), points};
}

/// What one thread solves.
class Sample {
 public:
  explicit Sample(const std::shared_ptr<const protocol::PointTable>& points)
      : points_(points), solver_({}, [this](std::span<const solver::ModelParameters> models) {
          const auto start = Clock::now();
          auto falls = solver::solve_falls(models);
          rate_.falls += models.size();
          rate_.falls_s += seconds_since(start);
          return falls;
        }) {}

  /// Solves batch `first`, then each `stride`-th one, until the time is over. What is under way
  /// then is finished.
  void solve(std::uint64_t first, std::uint64_t stride, Clock::time_point end) {
    const auto start = Clock::now();
    const std::uint64_t batches = (points_->size() + kTogether - 1) / kTogether;
    for (std::uint64_t number = first; number < std::max(batches, stride); number += stride) {
      solve(batch_number(number, points_), end);
      if (Clock::now() >= end) {
        break;
      }
    }
    rate_.points_s = seconds_since(start) - rate_.falls_s;
  }

  const SolvingRate& rate() const { return rate_; }

 private:
  void solve(const worker::Batch& batch, Clock::time_point end) {
    constexpr std::uint64_t kFewest = 4;
    std::uint64_t next = batch.first_point;
    std::uint64_t given = 0;
    solver_.solve(
        batch,
        [&]() -> std::optional<std::uint64_t> {
          const std::uint64_t past = batch.first_point + batch.count;
          next = points_->first_left_in(std::min(next, past), past);
          if (next >= past || (given >= kFewest && Clock::now() >= end)) {
            return std::nullopt;
          }
          ++given;
          return next++;
        },
        [this](protocol::PointResult&&) { ++rate_.points; });
  }

  const std::shared_ptr<const protocol::PointTable>& points_;
  SolvingRate rate_;
  worker::PointSolver solver_;
};

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
  const std::size_t threads = std::max(1U, std::thread::hardware_concurrency());
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(budget_s));
  std::vector<std::unique_ptr<Sample>> samples;
  for (std::size_t i = 0; i < threads; ++i) {
    samples.push_back(std::make_unique<Sample>(points));
  }
  {
    std::vector<std::jthread> at_work;
    for (std::size_t i = 0; i < threads; ++i) {
      at_work.emplace_back([&, i] { samples[i]->solve(i, threads, end); });
    }
  }
  SolvingRate total;
  total.threads = threads;
  for (const auto& sample : samples) {
    total.points += sample->rate().points;
    total.points_s += sample->rate().points_s;
    total.falls += sample->rate().falls;
    total.falls_s += sample->rate().falls_s;
  }
  return total;
}

}  // namespace oblique::client
