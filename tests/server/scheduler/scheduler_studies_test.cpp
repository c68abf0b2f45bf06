// Tests of studies: how they share workers, reuse results, grow and are deleted.
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

/// Returns how many of the next `batches` batches each study gets.
std::map<StudyId, int> shares(SchedulerBench& bench, std::uint32_t batches) {
  std::map<StudyId, int> counts;
  for (const auto& batch : only<SendBatch>(bench.feed(CreditGiven{1, batches}))) {
    ++counts[batch.study];
  }
  return counts;
}

TEST(SchedulerShare, StudiesOfEqualPriorityShareTheWorkersEqually) {
  SchedulerBench bench(table_of(1'000'000), trusting());
  bench.feed(StudyAdded{2, table_of(1'000'000), {}});
  bench.feed(WorkerJoined{1, 1});
  const auto counts = shares(bench, 400);
  EXPECT_NEAR(counts.at(1), 200, 2);
  EXPECT_NEAR(counts.at(2), 200, 2);
}

TEST(SchedulerShare, AStudyOfAHigherPriorityComesFirst) {
  SchedulerBench bench(table_of(1'000'000), trusting());
  bench.feed(StudyAdded{2, table_of(1'000'000), {}, 0, false, false, 5});
  bench.feed(WorkerJoined{1, 1});
  EXPECT_EQ(shares(bench, 10).count(1), 0U);
  bench.feed(StudyPaused{2});
  EXPECT_EQ(shares(bench, 10).at(1), 10);
}

TEST(SchedulerShare, AStudyThatOpensLaterOrAgainGetsNoExtraBatches) {
  for (const bool is_reopened : {false, true}) {
    SchedulerBench bench(table_of(1'000'000), trusting());
    StudyAdded other{2, table_of(1'000'000), {}};
    other.paused = true;
    if (is_reopened) {
      bench.feed(other);
    }
    bench.feed(WorkerJoined{1, 1});
    EXPECT_EQ(shares(bench, 100).at(1), 100);
    other.paused = false;
    is_reopened ? bench.feed(StudyReopened{2}) : bench.feed(other);
    const auto counts = shares(bench, 100);
    EXPECT_NEAR(counts.at(1), 50, 1);
    EXPECT_NEAR(counts.at(2), 50, 1);
  }
}

TEST(SchedulerShare, ForgottenFailuresAreFreeAgainAndOthersStayCompleted) {
  SchedulerBench bench(trusting());
  IntervalSet completed(0, 10);
  bench.feed(StudyAdded{1, table_of(10), completed, 3});
  bench.feed(WorkerJoined{1, 1});
  EXPECT_TRUE(shares(bench, 1).empty()) << "all points are completed";
  IntervalSet failures(2, 4);
  failures.insert(7);
  const auto batches = only<SendBatch>(bench.feed(FailuresForgotten{1, failures}));
  ASSERT_EQ(batches.size(), 1U);
  EXPECT_EQ(batches[0].first_point(), 2U);
  EXPECT_EQ(bench.scheduler.study(1).failed, 0U);
  EXPECT_EQ(bench.scheduler.study(1).solved(), 7U);
}

// ---- Reuse of results of other studies ----

StudyAdded held_study(std::uint64_t points) {
  StudyAdded added{1, table_of(points), {}};
  added.held = true;
  return added;
}

TEST(SchedulerReuse, ReusedPointsAreNotLeased) {
  SchedulerBench bench;
  bench.feed(held_study(10));
  bench.feed(PointsReused{1, IntervalSet(2, 10)});
  EXPECT_EQ(bench.scheduler.study(1).solved(), 8U);
  bench.feed(StudyHeld{1, false});
  const auto batches = bench.join(1, 4);
  ASSERT_THAT(batches, Not(IsEmpty()));
  EXPECT_LE(batches.back().first_point() + batches.back().count(), 2U);
}

TEST(SchedulerReuse, AStudyWithAllPointsReusedIsFinished) {
  SchedulerBench bench;
  bench.feed(held_study(10));
  bench.feed(PointsReused{1, IntervalSet(0, 5)});
  EXPECT_THAT(only<StudyFinished>(bench.feed(PointsReused{1, IntervalSet(5, 10)})), SizeIs(1));
  bench.feed(StudyHeld{1, false});
  EXPECT_THAT(bench.join(1, 4), IsEmpty());
}

TEST(SchedulerReuse, LeasedPointsAreReusedTooAndTheirBatchIsReleased) {
  SchedulerBench bench(table_of(1000), trusting());
  bench.feed(WorkerJoined{1, 1});
  const auto batches = only<SendBatch>(bench.feed(CreditGiven{1, 2}));
  ASSERT_THAT(batches, SizeIs(2));
  const auto& second = batches[1];
  const IntervalSet reused(second.first_point(), second.first_point() + second.count() + 5);
  const auto released = only<ReleaseBatch>(bench.feed(PointsReused{1, reused}));
  ASSERT_THAT(released, SizeIs(1));
  EXPECT_EQ(released[0].lease, second.lease);
  bench.feed(WorkerLeft{1});
  EXPECT_EQ(bench.scheduler.study(1).solved(), second.count() + 5);
}

TEST(SchedulerReuse, AStudyCanBePausedCancelledAndReopenedDuringItsLookup) {
  SchedulerBench bench;
  bench.feed(held_study(10));
  EXPECT_THAT(bench.join(1, 4), IsEmpty());
  bench.feed(StudyPaused{1});
  EXPECT_THAT(only<SendBatch>(bench.feed(StudyHeld{1, false})), IsEmpty());
  bench.feed(StudyHeld{1, true});
  EXPECT_THAT(only<SendBatch>(bench.feed(StudyReopened{1})), IsEmpty());
  EXPECT_THAT(only<SendBatch>(bench.feed(StudyHeld{1, false})), Not(IsEmpty()));
}

TEST(SchedulerReuse, SuspectPointsAreReusedToo) {
  SchedulerBench bench(table_of(3));
  // Both workers are lost while they hold all points.
  for (WorkerId worker = 1; worker <= 2; ++worker) {
    bench.join(worker, 4);
    bench.feed(WorkerUnreachable{worker});
  }
  EXPECT_THAT(only<StudyFinished>(bench.feed(PointsReused{1, IntervalSet(0, 3)})), SizeIs(1));
}

// ---- Growth and deletion ----

TEST(SchedulerGrowthTest, AfterGrowthOfADoneStudyOnlyTheFurtherPointsAreLeased) {
  SchedulerBench bench(table_of(10), trusting());
  bench.solve_all(bench.join(1, 3));
  ASSERT_EQ(bench.scheduler.study(1).open(), 0U);
  const auto effects = bench.feed(StudyGrown{1, table_of(25)});
  const auto batches = only<SendBatch>(effects);
  ASSERT_FALSE(batches.empty());
  EXPECT_EQ(batches.front().first_point(), 10U);
  EXPECT_EQ(bench.scheduler.study(1).open(), 15U);
  bench.solve_all(batches);
  EXPECT_EQ(bench.scheduler.study(1).completed, 25U);
}

TEST(SchedulerGrowthTest, AfterGrowthAWorkerGetsTheRecipeOnceBeforeItsNextBatch) {
  SchedulerSettings settings = trusting();
  settings.tail_batches_per_thread = 0;
  settings.first_batch_points = 5;
  settings.lanes = 1;
  SchedulerBench bench(table_of(10), settings);
  const auto first = bench.join(1, 1).at(0);
  ASSERT_LT(first.first_point() + first.count(), 10U);
  EXPECT_TRUE(only<DefineStudy>(bench.feed(StudyGrown{1, table_of(30)})).empty());
  const auto old = bench.feed(CreditGiven{1, 1});
  ASSERT_LE(only<SendBatch>(old).at(0).first_point() + only<SendBatch>(old).at(0).count(), 10U);
  EXPECT_TRUE(std::holds_alternative<DefineStudy>(old[0]));
  const auto further = bench.feed(CreditGiven{1, 1});
  EXPECT_GE(only<SendBatch>(further).at(0).first_point(), 10U);
  EXPECT_TRUE(only<DefineStudy>(further).empty()) << "the definition was sent twice";
}

TEST(SchedulerGrowthTest, ResultsOfAnEarlierBatchCountAfterGrowth) {
  SchedulerBench bench(table_of(4));
  const auto batch = bench.join(1, 1).at(0);
  bench.feed(StudyGrown{1, table_of(8)});
  bench.solve_and_store(batch);
  EXPECT_EQ(bench.scheduler.study(1).completed, batch.count());
}

TEST(SchedulerGrowthTest, GrowthReopensPausedAndCancelledStudies) {
  for (const bool is_paused : {true, false}) {
    SchedulerBench bench(table_of(10), trusting());
    is_paused ? bench.feed(StudyPaused{1}) : bench.feed(StudyCancelled{1});
    EXPECT_TRUE(bench.join(1, 1).empty());
    EXPECT_FALSE(only<SendBatch>(bench.feed(StudyGrown{1, table_of(20)})).empty());
    EXPECT_FALSE(bench.scheduler.study(1).cancelled);
  }
}

TEST(SchedulerGrowthTest, GrowthSetsThePriority) {
  SchedulerBench bench(table_of(10));
  bench.feed(StudyAdded{2, table_of(10), {}});
  bench.feed(StudyGrown{2, table_of(20), 7});
  EXPECT_EQ(bench.join(1, 1).at(0).study, 2U);
}

TEST(SchedulerGrowthTest, GrowthOfAnUnknownStudyOrWithoutFurtherPointsHasNoEffect) {
  SchedulerBench bench;
  bench.join(1, 1);
  EXPECT_TRUE(bench.feed(StudyGrown{1, table_of(10)}).empty());
  bench.feed(StudyAdded{1, table_of(10), {}, 0, true});
  EXPECT_TRUE(bench.feed(StudyGrown{1, table_of(10)}).empty());
  EXPECT_TRUE(bench.scheduler.study(1).cancelled);
}

TEST(SchedulerRemovalTest, WorkersDropADeletedStudyAndGetAnother) {
  SchedulerBench bench(table_of(10));
  bench.join(1, 2);
  const auto batches = bench.feed(StudyAdded{2, table_of(10), {}});
  ASSERT_TRUE(only<SendBatch>(batches).empty());
  const auto effects = bench.feed(StudyRemoved{1});
  EXPECT_EQ(only<WithdrawStudy>(effects).size(), 1U);
  EXPECT_FALSE(bench.scheduler.has_study(1));
  EXPECT_EQ(bench.scheduler.leases(), 0U);
  EXPECT_EQ(only<SendBatch>(bench.feed(CreditGiven{1, 1})).at(0).study, 2U);
}

TEST(SchedulerRemovalTest, ResultsOfADeletedStudyAreDroppedAndAcknowledged) {
  SchedulerBench bench(table_of(10));
  const auto batch = bench.join(1, 1).at(0);
  bench.feed(StudyRemoved{1});
  const auto stores = only<StoreResults>(bench.solve(batch));
  ASSERT_EQ(stores.size(), 1U);
  EXPECT_TRUE(stores[0].accepted.empty());
  EXPECT_EQ(
      only<AcknowledgeResults>(bench.feed(ResultsStored{1, 1, stores[0].sequence, {}})).size(), 1U);
}

TEST(SchedulerRemovalTest, ResultsThatAreBeingWrittenDuringADeletionAreAcknowledged) {
  SchedulerBench bench(table_of(1));
  const auto batch = bench.join(1, 1).at(0);
  const auto store = only<StoreResults>(bench.solve(batch)).at(0);
  bench.feed(StudyRemoved{1});
  const auto effects = bench.feed(ResultsStored{1, 1, store.sequence, {{0, false}}});
  EXPECT_EQ(only<AcknowledgeResults>(effects).size(), 1U);
  EXPECT_TRUE(only<StudyFinished>(effects).empty());
}

TEST(SchedulerRemovalTest, LossesOfPointsOfADeletedStudyAreForgotten) {
  SchedulerBench bench(table_of(1));
  // Six processes that hold batches are lost. So the scheduler stores losses for points of both
  // studies.
  bench.feed(StudyAdded{2, table_of(1000), {}});
  for (WorkerId worker = 1; worker <= 6; ++worker) {
    bench.join_as("process " + std::to_string(worker), worker, 1);
    bench.pass(4000);  // the worker is lost
  }
  bench.feed(StudyRemoved{1});
  bench.feed(StudyRemoved{2});
  EXPECT_TRUE(only<StoreFailure>(bench.pass(30'000)).empty());
  for (WorkerId worker = 1; worker <= 6; ++worker) {  // they return
    bench.join_as("process " + std::to_string(worker), 10 + worker, 1);
  }
  bench.feed(StudyAdded{3, table_of(10), {}});
  EXPECT_EQ(bench.scheduler.study(3).completed, 0U);
}

// ---- Solver versions ----

/// Returns a study of 100 points; the first point has a result of solver version 1.0.
StudyAdded old_study(std::uint64_t failed = 0) {
  StudyAdded added{.study = 1, .table = table_of(100), .completed = IntervalSet(0, 1)};
  added.failed = failed;
  added.solver_version = "1.0";
  return added;
}

TEST(SchedulerVersion, AStudyWithResultsOfAnotherVersionIsNotLeased) {
  SchedulerBench bench(SchedulerSettings{}, "2.0");
  bench.feed(old_study());
  EXPECT_TRUE(bench.join(1, 1).empty());
  EXPECT_TRUE(bench.scheduler.study(1).is_of_other_solver);
  EXPECT_EQ(only<SendBatch>(bench.feed(StudyAdded{2, table_of(100), {}})).at(0).study, 2U);
  EXPECT_FALSE(bench.scheduler.study(2).is_of_other_solver);
  EXPECT_EQ(bench.scheduler.study(2).solver_version, "2.0");
}

TEST(SchedulerVersion, AStudyWhoseOnlyResultsWereForgottenFailuresIsLeased) {
  SchedulerBench bench(SchedulerSettings{}, "2.0");
  bench.feed(old_study(1));
  EXPECT_TRUE(bench.join(2, 1).empty());
  EXPECT_EQ(only<SendBatch>(bench.feed(FailuresForgotten{1, IntervalSet(0, 1)})).size(), 1U);
}

TEST(SchedulerVersion, ResultsForAStudyOfAnotherVersionAreAcknowledgedAndNotStored) {
  SchedulerBench bench(SchedulerSettings{}, "2.0");
  bench.feed(old_study());
  bench.join(2, 0);
  const auto effects = bench.feed(ResultsReceived{2, 1, 0, 1, false, 0.1, {{5, false}}});
  ASSERT_EQ(only<StoreResults>(effects).size(), 1U);
  EXPECT_TRUE(only<StoreResults>(effects)[0].accepted.empty());
  EXPECT_EQ(only<AcknowledgeResults>(bench.feed(ResultsStored{2, 1, 1, {}})).size(), 1U);
}

}  // namespace
}  // namespace oblique::server
