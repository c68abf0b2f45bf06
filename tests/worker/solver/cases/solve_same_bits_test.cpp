#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "tests/worker/solver/cases/same_bits.h"
#include "tests/worker/solver/cases/shared_fingers.h"
#include "worker/solver/falls.h"

namespace oblique::solver {
namespace {

/// Returns points of all kinds of impact, short and long, numbered from 0.
std::vector<FingerPoint> points_of(const Finger& finger) {
  std::vector<FingerPoint> list;
  for (const double H_m : {0.3, 0.9, 1.0, 1.04}) {
    for (const double mu : {0.0, 0.4, 0.9, 1.4}) {
      for (const double e_star : {1.0, 0.7, 0.15}) {
        list.push_back({finger, list.size(), {H_m, mu, e_star}});
      }
    }
  }
  return list;
}

using Results = std::map<std::uint64_t, CaseResult>;

Results solved_together(const std::vector<FingerPoint>& list) {
  Results results;
  std::size_t next = 0;
  solve_points(
      [&]() -> std::optional<FingerPoint> {
        return next < list.size() ? std::optional(list[next++]) : std::nullopt;
      },
      [&results](Outcome&& outcome) {
        EXPECT_TRUE(outcome.result) << outcome.error;
        EXPECT_TRUE(results.emplace(outcome.number, std::move(*outcome.result)).second);
      });
  return results;
}

Results solved_one_by_one(const std::vector<FingerPoint>& list) {
  Results results;
  for (const auto& [finger, number, point] : list) {
    results.emplace(number, finger.solve(point.H_m, point.mu, point.e_star));
  }
  return results;
}

void expect_same(const Results& a, const Results& b) {
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [number, result] : a) {
    SCOPED_TRACE(number);
    ASSERT_TRUE(b.contains(number));
    expect_same_bits(result, b.at(number));
  }
}

void expect_same_in_any_company(std::vector<FingerPoint> list) {
  const Results alone = solved_one_by_one(list);
  expect_same(solved_together(list), alone);
  std::mt19937_64 generator(1);
  for (int shuffle = 0; shuffle < 3; ++shuffle) {
    std::shuffle(list.begin(), list.end(), generator);
    expect_same(solved_together(list), alone);
  }
}

TEST(SameBits, DoNotDependOnThePointsSolvedBefore) {
  const auto list = points_of(Finger{coarse_model()});
  expect_same(solved_one_by_one({list.rbegin(), list.rend()}),
              solved_one_by_one(points_of(coarse_finger())));
}

TEST(SameBits, DoNotDependOnThePointsInOtherLanes) {
  expect_same_in_any_company(points_of(coarse_finger()));
}

TEST(SameBits, ResultFromThreadsThatShareAFinger) {
  const auto list = points_of(Finger{coarse_model()});
  std::vector<Results> by_thread(4);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < by_thread.size(); ++i) {
    threads.emplace_back([&, i] {
      // The thread that starts first solves the fall.
      by_thread[i] = i % 2 == 0 ? solved_together(list) : solved_one_by_one(list);
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  const Results alone = solved_one_by_one(points_of(coarse_finger()));
  for (const Results& results : by_thread) {
    expect_same(results, alone);
  }
}

/// Returns points numbered from 0. Some models share a fall, some have chains of the same shape,
/// some have nothing in common.
std::vector<FingerPoint> mixed_points() {
  std::vector<ModelParameters> models(8, coarse_model());
  models[1].k_N_m = 1.3e7;
  models[2].eta2 = 2.0;
  models[3].E_Pa = 5e10;
  models[4].lengths_m = {0.4, 0.3, 0.45};
  models[4].tip_mass_kg = 0.1;
  models[5].elements_per_link = 2;
  models[6].integrator = Integrator::kGeneralizedAlpha;
  models[6].dt_fall_s = 1e-4;
  models[7].dt_s = 5e-7;
  const std::vector<FallOutcome> falls = solve_falls(models);
  std::vector<FingerPoint> mixed_points;
  for (std::size_t i = 0; i < models.size(); ++i) {
    const Finger finger(models[i], falls[i].fallen);
    for (const double mu : {0.4, 1.2}) {
      for (const double e_star : {1.0, 0.6}) {
        mixed_points.push_back({finger, mixed_points.size(), {0.9, mu, e_star}});
        mixed_points.push_back({finger, mixed_points.size(), {0.5, mu, e_star}});
      }
    }
  }
  return mixed_points;
}

TEST(SameBits, ResultFromPointsOfMixedModels) {
  expect_same_in_any_company(mixed_points());
}

TEST(SameBits, ResultWithAndWithoutATrace) {
  int rows = 0;
  Tracing tracing;
  tracing.sink = [&rows](const TraceRow&) { ++rows; };
  const CaseResult traced = coarse_finger().solve(1.0, 0.9, 0.7, tracing);
  EXPECT_GT(rows, 10);
  expect_same_bits(traced, coarse_finger().solve(1.0, 0.9, 0.7));
}

}  // namespace
}  // namespace oblique::solver
