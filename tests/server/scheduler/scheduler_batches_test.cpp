// Tests of the sizes of batches, and of the points that batches contain.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/server/scheduler/scheduler_bench.h"
#include "tests/support/recipes.h"
#include "worker/solver/model/parameters.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::PointTable;
using protocol::range;

// ---- Pace ----

/// Settings with which the size of batches depends only on the worker's time per point.
SchedulerSettings by_pace_alone() {
  SchedulerSettings settings = trusting();
  settings.tail_batches_per_thread = 0;
  settings.growth = 1'000'000;
  return settings;
}

TEST(SchedulerPace, TheNewestBatchHasHalfOfTheWeight) {
  SchedulerSettings settings = by_pace_alone();
  settings.first_batch_points = 100;
  SchedulerBench bench(table_of(1'000'000), settings);
  const SendBatch second = bench.next_after(bench.join(1, 1).at(0), 1e-3);
  EXPECT_EQ(second.count(), 100U) << "0.1 s at 1 ms per point";
  EXPECT_EQ(bench.next_after(second, 3e-3).count(), 50U) << "0.1 s at 2 ms per point";
}

TEST(SchedulerPace, AMessageIsWeightedByItsPointsSoThatOneFallChangesThePaceLittle) {
  SchedulerSettings settings = by_pace_alone();
  settings.first_batch_points = 1000;
  SchedulerBench bench(table_of(1'000'000), settings);
  const SendBatch first = bench.join(1, 1).at(0);
  const auto part = [&](std::uint64_t from, std::uint64_t to, double busy_s, bool is_last) {
    ResultsReceived message{1, 1, first.lease, ++bench.sequence, is_last, busy_s, {}};
    for (std::uint64_t point = from; point < to; ++point) {
      message.outcomes.push_back({point, false});
    }
    bench.feed(message);
  };
  part(0, 10, 0.2, false);
  part(10, 1000, 0.099, true);
  const SendBatch next = only<SendBatch>(bench.feed(CreditGiven{1, 1})).at(0);
  EXPECT_NEAR(static_cast<double>(next.count()), 0.1 / (0.299 / 1000), 5.0);
}

TEST(SchedulerPace, AnImplausiblyLongTimeIsLimited) {
  SchedulerSettings settings = by_pace_alone();
  settings.first_batch_points = 100;
  SchedulerBench bench(table_of(1'000'000), settings);
  EXPECT_EQ(bench.next_after(bench.join(1, 1).at(0), 1e9).count(), 100U);
}

TEST(SchedulerPace, SlowPointsOfOneModelFillTheLanes) {
  SchedulerBench bench(table_of(1'000'000), by_pace_alone());
  const SendBatch second = bench.next_after(bench.join(1, 1).at(0), 0.5);
  EXPECT_EQ(second.count(), 8U)
      << "0.5 s per point, and eight points together take little longer than one";
  const SendBatch third = bench.next_after(second, 5.0);
  EXPECT_LT(third.count(), 4U) << "points that take minutes do not fill all lanes";
}

TEST(SchedulerPace, TheLastBatchesOfAStudyHaveAMinimumDuration) {
  SchedulerSettings settings = trusting();
  settings.shortest_batch_s = 0.01;
  SchedulerBench bench(table_of(1000), settings);
  SendBatch batch = bench.join(1, 1).at(0);
  std::vector<std::uint64_t> counts;
  for (std::uint64_t left = 1000 - batch.count(); left > 0; left -= batch.count()) {
    batch = bench.next_after(batch, 1e-4);
    counts.push_back(batch.count());
  }
  EXPECT_GE(counts.at(counts.size() - 2), 100U) << "0.01 s at 0.1 ms per point";
  EXPECT_LT(counts.size(), 12U);
}

TEST(SchedulerPace, ABatchGrowsAtMostByTheGrowthFactor) {
  SchedulerSettings settings = by_pace_alone();
  settings.growth = 4;
  SchedulerBench bench(table_of(1'000'000), settings);
  const SendBatch first = bench.join(1, 1).at(0);
  EXPECT_EQ(bench.next_after(first, 1e-6).count(), 4 * first.count());
}

// ---- Ends of batches ----

/// Two models of 10 points each, then 30 points of the base model, then 40 models of one point
/// each.
PointTable mixed_table() {
  return PointTable(protocol::recipe_of(
      {{listed("E", {6e10, 7e10}), listed("H", {1.0}), range("mu", 0.1, 1.0, 10), listed("e", {1})},
       {listed("H", {1.0}), range("mu", 0.1, 1.0, 30), listed("e", {1.0})},
       {range("k", 1e7, 2e7, 40), listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})}}));
}

std::uint64_t cut(const Interval& free, const BatchSize& wanted) {
  return end_of_batch(mixed_table(), PointOrder{}, free, wanted);
}

TEST(BatchCut, ABatchEndsWithAModelAndContainsAsManyAsFit) {
  EXPECT_EQ(cut({0, 90}, {.points = 12}), 10U);
  EXPECT_EQ(cut({0, 90}, {.points = 18, .most_points = 25}), 10U);
  EXPECT_EQ(cut({8, 90}, {.points = 8, .most_points = 12}), 20U)
      << "the model has only two points left, so the next one is added";
  EXPECT_EQ(cut({20, 90}, {.points = 12, .most_points = 29}), 32U)
      << "the rest of the model exceeds the limit and is divided";
  EXPECT_EQ(cut({20, 90}, {.points = 12, .most_points = 30}), 50U);
  EXPECT_EQ(cut({50, 90}, {.points = 3, .groups = 8, .most_points = 100}), 58U);
  EXPECT_EQ(cut({50, 90}, {.points = 3, .groups = 8, .most_points = 5}), 55U);
  EXPECT_EQ(cut({0, 90}, {.points = 3, .groups = 2, .most_points = 20}), 20U);
  EXPECT_EQ(cut({0, 90}, {.points = 3, .groups = 2, .most_points = 19}), 10U);
}

TEST(BatchCut, ABatchStaysWithinTheFreePoints) {
  for (std::uint64_t begin = 0; begin < 90; begin += 7) {
    for (std::uint64_t end = begin + 1; end <= 90; end += 5) {
      for (const std::uint64_t points : {0U, 1U, 8U, 17U, 1000U}) {
        for (const std::uint64_t most : {0U, 9U, 40U, 1000U}) {
          const auto at = cut({begin, end}, {points, 8, most, {}});
          ASSERT_GT(at, begin);
          ASSERT_LE(at, end);
          ASSERT_LE(at - begin, std::max({points, most, std::uint64_t{1}}));
        }
      }
    }
  }
}

// ---- Several models ----

/// Returns a table of `models` models with `points` points each.
std::shared_ptr<const PointTable> table_of_models(std::uint64_t models, std::uint64_t points) {
  return std::make_shared<const PointTable>(protocol::recipe_of(
      {{range("E", 6e10, 7e10, models), listed("H", {1.0}),
        points == 1 ? listed("mu", {0.4}) : range("mu", 0.1, 1.0, points), listed("e", {1.0})}}));
}

/// In a study with kMany points per model, `model_of` returns the model of a batch's first point.
constexpr std::uint64_t kMany = 100'000;
std::uint64_t model_of(const SendBatch& batch) {
  return batch.first_point() / kMany;
}

TEST(SchedulerModels, TheFirstBatchHasAModelForEachLane) {
  SchedulerBench bench(table_of_models(10'000, 1));
  const auto batches = bench.join(1, 2, 3);
  ASSERT_EQ(batches.size(), 2U);
  EXPECT_EQ(batches[0].count(), 24U);
  EXPECT_EQ(batches[1].first_point(), 24U);
}

TEST(SchedulerModels, BatchesOfOnePointPerModelFillLanesEvenIfAFallExceedsTheTarget) {
  SchedulerBench bench(table_of_models(10'000, 1), trusting());
  SendBatch batch = bench.join(1, 1).at(0);
  for (int i = 0; i < 5; ++i) {
    batch = bench.next_after(batch, 0.5);
    EXPECT_EQ(batch.count(), 8U);
  }
  for (int i = 0; i < 5; ++i) {
    batch = bench.next_after(batch, 30.0);
  }
  EXPECT_EQ(batch.count(), 1U) << "losing a worker with more points would cost minutes";
}

TEST(SchedulerModels, AtTheEndOfAStudyEveryWorkerHasPoints) {
  SchedulerBench bench(trusting());
  bench.feed(WorkerJoined{1, 1});
  bench.feed(WorkerJoined{2, 1});
  bench.feed(CreditGiven{1, 2});
  bench.feed(CreditGiven{2, 2});
  const auto batches = only<SendBatch>(bench.feed(StudyAdded{1, table_of_models(14, 1), {}}));
  ASSERT_EQ(batches.size(), 2U);
  EXPECT_EQ(batches[0].count(), 7U);
  EXPECT_EQ(batches[1].count(), 7U);
  EXPECT_NE(batches[0].worker, batches[1].worker);
}

TEST(SchedulerModels, ABatchEndsWithAModelIfPossible) {
  SchedulerBench bench(table_of_models(2000, 9), trusting());
  SendBatch batch = bench.join(1, 1).at(0);
  std::uint64_t whole = 0;
  for (int i = 0; i < 12; ++i) {
    batch = bench.next_after(batch, 1e-3);
    whole += (batch.first_point() + batch.count()) % 9 == 0 ? 1U : 0U;
  }
  EXPECT_GE(whole, 10U) << "only the first batches may end within a model";
}

TEST(SchedulerModels, ModelsOfManyPointsFillLanesUpToTheirLongestTime) {
  SchedulerBench bench(table_of_models(1000, 1000), trusting());
  SendBatch batch = bench.join(1, 1).at(0);
  for (int i = 0; i < 20; ++i) {
    batch = bench.next_after(batch, 1e-4);
  }
  EXPECT_EQ(batch.count(), 8000U) << "0.8 s, and eight falls are solved together";
  for (int i = 0; i < 20; ++i) {
    batch = bench.next_after(batch, 5e-4);
  }
  EXPECT_EQ(batch.count(), 2000U) << "1 s";
}

TEST(SchedulerModels, WorkersGetDifferentModelsWhileThereAreEnough) {
  SchedulerBench bench(table_of_models(3, kMany), trusting());
  std::vector<SendBatch> held;
  for (const WorkerId worker : {1U, 2U, 3U}) {
    held.push_back(bench.join(worker, 1).at(0));
  }
  for (int round = 0; round < 10; ++round) {
    for (std::uint64_t i = 0; i < held.size(); ++i) {
      EXPECT_EQ(model_of(held[i]), i) << "the worker has the fall of its model in its cache";
      held[i] = bench.next_after(held[i], 1e-4);
    }
  }
  EXPECT_EQ(model_of(bench.join(4, 1).at(0)), 0U)
      << "a new worker joins a started model because no other is left";
}

TEST(SchedulerModels, AWorkerFinishesItsModelEvenIfAnotherHasPartOfIt) {
  SchedulerBench bench(table_of_models(2, kMany), trusting());
  const SendBatch first = bench.join(1, 1).at(0);
  const SendBatch other = bench.join(2, 1).at(0);
  const SendBatch helper = bench.join(3, 1).at(0);
  EXPECT_EQ(model_of(helper), model_of(first));
  EXPECT_EQ(model_of(bench.next_after(first, 1e-4)), model_of(first));
  EXPECT_EQ(model_of(bench.next_after(other, 1e-4)), model_of(other));
}

TEST(SchedulerModels, ALongBatchCountsAsSeveralInTheShareOfAStudy) {
  SchedulerBench bench(table_of_models(100'000, 1), trusting());
  bench.feed(StudyAdded{2, table_of(1'000'000), {}});
  std::vector<SendBatch> held = bench.join(1, 2);
  double busy_s[3] = {};
  for (std::size_t i = 0; i < 500; ++i) {
    const SendBatch batch = held[i];
    const double s_per_point = batch.study == 1 ? 0.1 : 1e-4;
    busy_s[batch.study] += s_per_point * static_cast<double>(batch.count());
    held.push_back(bench.next_after(batch, s_per_point));
  }
  EXPECT_NEAR(busy_s[1] / busy_s[2], 1.0, 0.1);
}

// ---- Points of one fall that are not adjacent ----

std::shared_ptr<const PointTable> sample(std::uint64_t points, std::uint64_t falls) {
  return std::make_shared<const PointTable>(
      protocol::sample_with_falls(points, falls, protocol::SAMPLE_LATIN_HYPERCUBE));
}

/// Returns every `step`-th of `numbers` points, starting with point 0.
IntervalSet every(std::uint64_t step, std::uint64_t numbers) {
  IntervalSet points;
  for (std::uint64_t point = 0; point < numbers; point += step) {
    points.insert(point);
  }
  return points;
}

/// Returns the points of all batches, in the order of the batches.
std::vector<std::uint64_t> points_in(const std::vector<SendBatch>& batches) {
  std::vector<std::uint64_t> points;
  for (const SendBatch& batch : batches) {
    for (const Interval& range : batch.points) {
      for (std::uint64_t point = range.begin; point < range.end; ++point) {
        points.push_back(point);
      }
    }
  }
  return points;
}

TEST(SchedulerFalls, EachFallOfASampleGoesToOneWorkerExceptAFewSharedOnes) {
  SchedulerBench bench;
  const auto table = sample(20'000, 500);
  bench.feed(StudyAdded{1, table, {}});
  std::vector<SendBatch> batches;
  for (const WorkerId worker : {1U, 2U, 3U, 4U}) {
    for (const SendBatch& batch : bench.join(worker, 2)) {
      batches.push_back(batch);
    }
  }
  batches = bench.solve_all(batches, 5e-3);
  std::set<std::pair<std::uint64_t, WorkerId>> falls_solved;
  for (const SendBatch& batch : batches) {
    for (const std::uint64_t point : points_in({batch})) {
      const auto& model = table->model(table->point(point).model);
      falls_solved.emplace(solver::fall_hash(model), batch.worker);
    }
  }
  EXPECT_EQ(points_in(batches).size(), 20'000U);
  EXPECT_GE(falls_solved.size(), 500U);
  EXPECT_LE(falls_solved.size(), 530U);
  EXPECT_EQ(bench.scheduler.study(1).solved(), 20'000U);
}

TEST(SchedulerFalls, ARestartedServerLeasesTheRemainingPoints) {
  SchedulerBench bench;
  const IntervalSet completed = every(3, 2'000);
  bench.feed(StudyAdded{1, sample(2'000, 50), completed});
  const auto points = points_in(bench.solve_all(bench.join(1, 2), 5e-3));
  EXPECT_EQ(points.size(), 2'000U - completed.size());
  EXPECT_TRUE(
      std::ranges::none_of(points, [&](std::uint64_t point) { return completed.contains(point); }));
  EXPECT_EQ(bench.scheduler.study(1).solved(), 2'000U);
}

TEST(SchedulerFalls, PointsOfALostWorkerAreLeasedAgainAndAFailedPointKeepsItsNumber) {
  SchedulerBench bench(sample(300, 4), trusting());
  const std::uint64_t failed = bench.join(1, 1).at(0).first_point();
  bench.feed(WorkerLeft{1});
  EXPECT_EQ(points_in(bench.solve_all(bench.join(2, 2))).size(), 300U);
  const auto again =
      only<SendBatch>(bench.feed(FailuresForgotten{1, IntervalSet(failed, failed + 1)}));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].points, (std::vector<Interval>{{failed, failed + 1}}));
}

// ---- Open points between completed points, as in a fine grid that has reused a coarse grid ----

StudyPoints points_without(std::uint64_t numbers, IntervalSet completed) {
  return {StudyTable(table_of(numbers)), std::move(completed), 0};
}

Batch take(StudyPoints& points, const BatchSize& wanted) {
  const auto batch = points.take(wanted);
  points.check_invariants();
  return batch.value();
}

TEST(ScatteredPointsTest, ABatchSkipsCompletedPointsUntilItHasTheWantedSize) {
  StudyPoints points = points_without(100, every(2, 100));
  const Batch batch = take(points, {8});
  EXPECT_EQ(batch.first_place, 1U);
  EXPECT_EQ(batch.end(), 16U);
  EXPECT_EQ(batch.points, 8U);
  EXPECT_EQ(points.leased(), 8U);
  EXPECT_EQ(take(points, {8}).first_place, 17U);
}

TEST(ScatteredPointsTest, ABatchEndsBeforeLeasedPointsAndBeforeAWideGap) {
  StudyPoints points = points_without(1000, [] {
    IntervalSet completed(0, 3);
    completed.insert(5, 8);
    return completed;
  }());
  EXPECT_EQ(take(points, {2}).end(), 5U);
  points.reopen(IntervalSet(0, 8));
  EXPECT_EQ(take(points, {8}).end(), 3U) << "points 3 and 4 are still leased";

  StudyPoints sparse = points_without(1000, [] {
    IntervalSet completed(3, 500);
    completed.insert(505, 520);
    return completed;
  }());
  EXPECT_EQ(take(sparse, {8}).end(), 3U);
  const Batch next = take(sparse, {8});
  EXPECT_EQ(next.first_place, 500U);
  EXPECT_EQ(next.end(), 523U);
  EXPECT_EQ(next.points, 8U);
}

TEST(ScatteredPointsTest, ABatchContinuesWithAnotherModelOnlyIfAllItsPointsFit) {
  const auto table = std::make_shared<const protocol::PointTable>(
      protocol::recipe_of({{protocol::listed("E", {6e10, 7e10}), protocol::listed("H", {1.0}),
                            protocol::range("mu", 0.0, 1.0, 10), protocol::listed("e", {1.0})}}));
  StudyPoints points(StudyTable(table), every(2, 20), 0);
  EXPECT_EQ(take(points, {8}).end(), 10U)
      << "the fall of the second model belongs to another worker";
  StudyPoints both(StudyTable(table), every(2, 20), 0);
  EXPECT_EQ(take(both, {18}).end(), 20U);
}

TEST(ScatteredPointsTest, OnlyOpenPointsOfALostBatchAreReturned) {
  SchedulerSettings settings = trusting();
  settings.first_batch_points = 16;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1000), every(2, 1000)});
  ResultsReceived answer = bench.answer_to(bench.join(1, 1).at(0));
  ASSERT_EQ(answer.outcomes.size(), 16U);
  answer.outcomes.resize(5);
  answer.batch_done = false;
  bench.feed(answer);
  bench.feed(WorkerLeft{1});
  EXPECT_EQ(bench.scheduler.study(1).leased, 0U);
  EXPECT_EQ(points_in(bench.join(2, 1000)).size(), 495U);
}

TEST(ScatteredPointsTest, ResultsOfCompletedPointsWithinABatchAreIgnored) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(100), every(2, 100)});
  SendBatch batch = bench.join(1, 1).at(0);
  const std::uint64_t wanted = batch.count();
  ASSERT_GT(batch.points.size(), 1U);
  batch.points = {{batch.points.front().begin, batch.points.back().end}};
  const auto stores = only<StoreResults>(bench.solve(batch));
  ASSERT_EQ(stores.size(), 1U);
  EXPECT_EQ(stores[0].accepted.size(), wanted);
}

}  // namespace
}  // namespace oblique::server
