// Points between settled ones, as where a finer grid has taken over a coarser one: how batches are
// cut from them.
#include <algorithm>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "server/scheduler/study_points.h"
#include "tests/server/scheduler/scheduler_bench.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

/// All of `numbers` points but every `step`-th, the first included.
IntervalSet every(std::uint64_t step, std::uint64_t numbers) {
  IntervalSet points;
  for (std::uint64_t point = 0; point < numbers; point += step) {
    points.insert(point);
  }
  return points;
}

StudyPoints points_without(std::uint64_t numbers, IntervalSet settled) {
  return {StudyTable(table_of(numbers)), std::move(settled), 0, LossLimits{}};
}

Batch taken(StudyPoints& points, const BatchSize& wanted) {
  const auto batch = points.take(wanted);
  points.check_invariants();
  return batch.value();
}

TEST(ScatteredPointsTest, ABatchGoesOnBehindSettledPointsUntilItHasWhatIsWanted) {
  StudyPoints points = points_without(100, every(2, 100));
  const Batch batch = taken(points, {8});
  EXPECT_EQ(batch.first_place, 1U);
  EXPECT_EQ(batch.end(), 16U);
  EXPECT_EQ(batch.points, 8U);
  EXPECT_EQ(points.leased(), 8U);
  EXPECT_EQ(taken(points, {8}).first_place, 17U);
}

TEST(ScatteredPointsTest, ABatchEndsBeforePointsThatAnotherHoldsAndBeforeAWideGap) {
  StudyPoints points = points_without(1000, [] {
    IntervalSet settled(0, 3);
    settled.insert(5, 8);
    return settled;
  }());
  EXPECT_EQ(taken(points, {2}).end(), 5U);
  points.reopen(IntervalSet(0, 8));
  EXPECT_EQ(taken(points, {8}).end(), 3U) << "3 and 4 are still out";

  StudyPoints sparse = points_without(1000, [] {
    IntervalSet settled(3, 500);
    settled.insert(505, 520);
    return settled;
  }());
  EXPECT_EQ(taken(sparse, {8}).end(), 3U);
  const Batch next = taken(sparse, {8});
  EXPECT_EQ(next.first_place, 500U);
  EXPECT_EQ(next.end(), 523U);
  EXPECT_EQ(next.points, 8U);
}

TEST(ScatteredPointsTest, ABatchGoesOnIntoAnotherModelOnlyWhereThatHasRoomInIt) {
  const auto table = std::make_shared<const protocol::PointTable>(
      protocol::recipe_of({{protocol::listed("E", {6e10, 7e10}), protocol::listed("H", {1.0}),
                            protocol::range("mu", 0.0, 1.0, 10), protocol::listed("e", {1.0})}}));
  StudyPoints points(StudyTable(table), every(2, 20), 0, LossLimits{});
  EXPECT_EQ(taken(points, {8}).end(), 10U) << "the other's fall is another worker's";
  StudyPoints both(StudyTable(table), every(2, 20), 0, LossLimits{});
  EXPECT_EQ(taken(both, {18}).end(), 20U);
}

TEST(ScatteredPointsTest, TheWorkerIsToldWhatIsWantedOfTheBatchAndNothingIsHandedOutTwice) {
  SchedulerSettings settings = trusting();
  settings.first_batch_points = 16;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1000), every(2, 1000)});
  auto batches = bench.join(1, 2);
  std::vector<std::uint64_t> solved;
  while (!batches.empty()) {
    const SendBatch batch = batches.front();
    batches.erase(batches.begin());
    const auto outcomes = SchedulerBench::outcomes_of(batch);
    for (const PointOutcome& outcome : outcomes) {
      solved.push_back(outcome.point);
    }
    bench.feed({ResultsReceived{1, 1, batch.lease, ++bench.sequence, true, 1e-3, outcomes}});
    bench.feed(ResultsStored{1, 1, bench.sequence, outcomes});
    for (const auto& more : only<SendBatch>(bench.feed(CreditGiven{1, 1}))) {
      batches.push_back(more);
    }
  }
  ASSERT_EQ(solved.size(), 500U);
  for (std::size_t i = 0; i < solved.size(); ++i) {
    EXPECT_EQ(solved[i], 2 * i + 1);
  }
}

TEST(ScatteredPointsTest, WhatIsLeftOfALostBatchComesBackAndNothingBetween) {
  SchedulerSettings settings = trusting();
  settings.first_batch_points = 16;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1000), every(2, 1000)});
  const SendBatch batch = bench.join(1, 1).at(0);
  auto outcomes = SchedulerBench::outcomes_of(batch);
  ASSERT_EQ(outcomes.size(), 16U);
  outcomes.resize(5);
  bench.feed(ResultsReceived{1, 1, batch.lease, ++bench.sequence, false, 1e-3, outcomes});
  bench.feed(WorkerLeft{1});
  EXPECT_EQ(bench.scheduler.study(1).leased, 0U);
  std::uint64_t handed_out = 0;
  for (const SendBatch& again : bench.join(2, 1000)) {
    handed_out += again.count();
  }
  EXPECT_EQ(handed_out, 495U);
}

TEST(ScatteredPointsTest, ResultsOfSettledPointsBetweenThoseOfABatchAreNotTaken) {
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
