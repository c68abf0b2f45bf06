// Studies that get further points, and studies that are deleted.
#include <gtest/gtest.h>

#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

/// Everything of the study is solved by `worker`, whose batches these are.
void solve_all(SchedulerBench& bench, std::vector<SendBatch> held) {
  while (!held.empty()) {
    const SendBatch batch = held.back();
    held.pop_back();
    auto effects = bench.solve_and_store(batch);
    bench.append(effects, bench.feed(CreditGiven{batch.worker, 1}));
    for (const SendBatch& next : only<SendBatch>(effects)) {
      held.push_back(next);
    }
  }
}

TEST(SchedulerGrowthTest, OfAStudyThatIsDoneOnlyTheFurtherPointsAreHandedOut) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(10), {}});
  solve_all(bench, bench.join(1, 3));
  ASSERT_EQ(bench.scheduler.study(1).open(), 0U);
  const auto effects = bench.feed(StudyGrown{1, table_of(25)});
  const auto batches = only<SendBatch>(effects);
  ASSERT_FALSE(batches.empty());
  EXPECT_EQ(batches.front().first_point(), 10U);
  EXPECT_EQ(bench.scheduler.study(1).open(), 15U);
  solve_all(bench, batches);
  EXPECT_EQ(bench.scheduler.study(1).settled, 25U);
}

TEST(SchedulerGrowthTest, AWorkerIsToldOfTheFurtherPointsOnceBeforeItsNextBatch) {
  SchedulerSettings settings = trusting();
  settings.tail_batches_per_thread = 0;
  settings.first_batch_points = 5;
  settings.lanes = 1;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(10), {}});
  const auto first = bench.join(1, 1).at(0);
  ASSERT_LT(first.first_point() + first.count(), 10U);
  EXPECT_TRUE(only<DefineStudy>(bench.feed(StudyGrown{1, table_of(30)})).empty());
  const auto old = bench.feed(CreditGiven{1, 1});
  ASSERT_LE(only<SendBatch>(old).at(0).first_point() + only<SendBatch>(old).at(0).count(), 10U);
  EXPECT_TRUE(std::holds_alternative<DefineStudy>(old[0]));
  const auto further = bench.feed(CreditGiven{1, 1});
  EXPECT_GE(only<SendBatch>(further).at(0).first_point(), 10U);
  EXPECT_TRUE(only<DefineStudy>(further).empty()) << "told once";
}

TEST(SchedulerGrowthTest, ABatchOfBeforeCountsAlsoWhenItComesAfterTheGrowth) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(4), {}});
  const auto batch = bench.join(1, 1).at(0);
  bench.feed(StudyGrown{1, table_of(8)});
  bench.solve_and_store(batch);
  EXPECT_EQ(bench.scheduler.study(1).settled, batch.count());
}

TEST(SchedulerGrowthTest, PausedAndCancelledStudiesGoOn) {
  for (const bool is_paused : {true, false}) {
    SchedulerBench bench(trusting());
    bench.feed(StudyAdded{1, table_of(10), {}});
    is_paused ? bench.feed(StudyPaused{1}) : bench.feed(StudyCancelled{1});
    EXPECT_TRUE(bench.join(1, 1).empty());
    EXPECT_FALSE(only<SendBatch>(bench.feed(StudyGrown{1, table_of(20)})).empty());
    EXPECT_FALSE(bench.scheduler.study(1).cancelled);
  }
}

TEST(SchedulerGrowthTest, ThePriorityOfTheGrowthHolds) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(10), {}});
  bench.feed(StudyAdded{2, table_of(10), {}});
  bench.feed(StudyGrown{2, table_of(20), 7});
  EXPECT_EQ(bench.join(1, 1).at(0).study, 2U);
}

TEST(SchedulerGrowthTest, GrowthOfAnUnknownStudyOrToNoMorePointsIsNone) {
  SchedulerBench bench;
  bench.join(1, 1);
  EXPECT_TRUE(bench.feed(StudyGrown{1, table_of(10)}).empty());
  bench.feed(StudyAdded{1, table_of(10), {}, 0, true});
  EXPECT_TRUE(bench.feed(StudyGrown{1, table_of(10)}).empty());
  EXPECT_TRUE(bench.scheduler.study(1).cancelled);
}

TEST(SchedulerRemovalTest, WhoSolvesADeletedStudyDropsItAndGetsAnother) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(10), {}});
  bench.join(1, 2);
  const auto batches = bench.feed(StudyAdded{2, table_of(10), {}});
  ASSERT_TRUE(only<SendBatch>(batches).empty());
  const auto effects = bench.feed(StudyRemoved{1});
  EXPECT_EQ(only<WithdrawStudy>(effects).size(), 1U);
  EXPECT_FALSE(bench.scheduler.knows_study(1));
  EXPECT_EQ(bench.scheduler.leases(), 0U);
  EXPECT_EQ(only<SendBatch>(bench.feed(CreditGiven{1, 1})).at(0).study, 2U);
}

TEST(SchedulerRemovalTest, ResultsOfADeletedStudyAreDroppedAndAcknowledged) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(10), {}});
  const auto batch = bench.join(1, 1).at(0);
  bench.feed(StudyRemoved{1});
  const auto stores = only<StoreResults>(bench.solve(batch));
  ASSERT_EQ(stores.size(), 1U);
  EXPECT_TRUE(stores[0].accepted.empty());
  EXPECT_EQ(
      only<AcknowledgeResults>(bench.feed(ResultsStored{1, 1, stores[0].sequence, {}})).size(), 1U);
}

TEST(SchedulerRemovalTest, ResultsThatWereOnTheirWayToTheDiskAreAcknowledged) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
  const auto batch = bench.join(1, 1).at(0);
  const auto store = only<StoreResults>(bench.solve(batch)).at(0);
  bench.feed(StudyRemoved{1});
  const auto effects = bench.feed(ResultsStored{1, 1, store.sequence, {{0, false}}});
  EXPECT_EQ(only<AcknowledgeResults>(effects).size(), 1U);
  EXPECT_TRUE(only<StudyFinished>(effects).empty());
}

TEST(SchedulerRemovalTest, WhatLossesSaidOfItsPointsIsForgotten) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
  // Condemned: three proven processes were lost with the point alone.
  bench.feed(StudyAdded{2, table_of(1000), {}});
  for (WorkerId worker = 1; worker <= 6; ++worker) {
    bench.join_as("process " + std::to_string(worker), worker, 1);
    bench.pass(4000);  // it is lost
  }
  bench.feed(StudyRemoved{1});
  bench.feed(StudyRemoved{2});
  EXPECT_TRUE(only<StoreFailure>(bench.pass(30'000)).empty());
  for (WorkerId worker = 1; worker <= 6; ++worker) {  // they come back
    bench.join_as("process " + std::to_string(worker), 10 + worker, 1);
  }
  bench.feed(StudyAdded{3, table_of(10), {}});
  EXPECT_EQ(bench.scheduler.study(3).settled, 0U);
}

}  // namespace
}  // namespace oblique::server
