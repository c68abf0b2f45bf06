#include "server/scheduler/scheduler.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

TEST(SchedulerTest, AWorkerWithCreditGetsTheDefinitionOnceAndThenItsBatches) {
  SchedulerBench bench(table_of(100));
  bench.feed(WorkerJoined{5, 1});
  const auto effects = bench.feed(CreditGiven{5, 1});
  ASSERT_EQ(effects.size(), 2U);
  EXPECT_TRUE(std::holds_alternative<DefineStudy>(effects[0]));
  const auto batch = std::get<SendBatch>(effects[1]);
  EXPECT_EQ(batch.first_point(), 0U);
  EXPECT_EQ(batch.attempt, 1U);
  const auto further = bench.feed(CreditGiven{5, 1});
  EXPECT_EQ(only<SendBatch>(further).size(), 1U);
  EXPECT_TRUE(only<DefineStudy>(further).empty());
}

TEST(SchedulerTest, AWorkerGetsAtMostTheRequestedNumberOfBatches) {
  SchedulerBench bench(table_of(1'000'000), trusting());
  EXPECT_EQ(bench.join(5, 3).size(), 3U);
  EXPECT_TRUE(bench.pass(1000, {5}).empty());
}

TEST(SchedulerTest, ABatchMaySpanBlocks) {
  constexpr std::uint64_t kBlocks = 1000;
  const std::vector<protocol::Axis> point{
      protocol::listed("H", {1.0}), protocol::listed("mu", {0.4}), protocol::listed("e", {1.0})};
  SchedulerBench bench;
  bench.feed(StudyAdded{
      1, std::make_shared<const protocol::PointTable>(protocol::recipe_of({kBlocks, point})), {}});
  EXPECT_LT(bench.solve_all(bench.join(1, 1)).size(), kBlocks / 10);
}

TEST(SchedulerTest, TenPointsSpreadOverTwoWorkers) {
  SchedulerBench bench;
  bench.join(1, 2);
  bench.join(2, 2);
  const auto first = only<SendBatch>(bench.feed(StudyAdded{1, table_of(10), {}}));
  std::map<WorkerId, std::uint64_t> points;
  for (const auto& batch : first) {
    points[batch.worker] += batch.count();
  }
  EXPECT_EQ(points.size(), 2U);
  EXPECT_LE(std::max(points[1], points[2]), 5U);
}

TEST(SchedulerTest, BatchesShrinkTowardTheEnd) {
  SchedulerSettings settings;
  settings.shortest_batch_s = 0.0;
  SchedulerBench bench(table_of(2000), settings);
  std::vector<SendBatch> held;
  for (const WorkerId worker : {1U, 2U, 3U, 4U}) {
    held.push_back(bench.join(worker, 1).at(0));
  }
  std::vector<std::uint64_t> sizes;
  for (const SendBatch& batch : bench.solve_all(held, 1e-5)) {
    sizes.push_back(batch.count());
  }
  const auto largest = std::max_element(sizes.begin(), sizes.end());
  EXPECT_GT(*largest, 50U);
  EXPECT_EQ(sizes.back(), 1U);
  EXPECT_TRUE(std::is_sorted(largest, sizes.end(), std::greater<>()));
}

TEST(SchedulerTest, ResultsAreAcknowledgedOnlyAfterTheyAreStored) {
  SchedulerBench bench(table_of(1));
  const auto batch = bench.join(7, 1).at(0);
  const auto received = bench.solve(batch);
  ASSERT_EQ(only<StoreResults>(received).size(), 1U);
  EXPECT_TRUE(only<AcknowledgeResults>(received).empty());
  EXPECT_TRUE(only<StudyFinished>(received).empty());
  const auto stored = bench.feed(ResultsStored{7, 1, 1, {{0, false}}});
  ASSERT_EQ(only<AcknowledgeResults>(stored).size(), 1U);
  EXPECT_EQ(only<AcknowledgeResults>(stored)[0].sequence, 1U);
  EXPECT_EQ(only<StudyFinished>(stored).size(), 1U);
}

TEST(SchedulerTest, ADuplicateResultIsAcknowledgedButNotStored) {
  SchedulerBench bench(table_of(4));
  const auto batch = bench.join(7, 1).at(0);
  bench.solve_and_store(batch);
  const auto again = only<StoreResults>(bench.solve(batch));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_TRUE(again[0].accepted.empty());
  EXPECT_EQ(only<AcknowledgeResults>(bench.feed(ResultsStored{7, 1, 2, {}})).size(), 1U);
  EXPECT_EQ(bench.scheduler.study(1).solved(), batch.count());
}

TEST(SchedulerTest, RepeatedAndUnknownPointsInAMessageAreIgnored) {
  SchedulerBench bench(table_of(4));
  bench.join(7, 1);
  const auto store = only<StoreResults>(bench.feed(ResultsReceived{
      7, 1, 0, 1, false, 0.1, {{2, false}, {2, true}, {4, false}, {UINT64_MAX, false}}}));
  EXPECT_EQ(store.at(0).accepted, std::vector<std::size_t>{0});
}

TEST(SchedulerTest, ASilentWorkersPointsGoToAnotherWithinThreeSeconds) {
  SchedulerBench bench(table_of(4), trusting());
  const auto lost = bench.join(1, 1).at(0);
  bench.join(2, 0);
  bench.feed(CreditGiven{2, 9});
  const auto effects = bench.pass(3250, {2});
  ASSERT_EQ(only<DropWorker>(effects).size(), 1U);
  EXPECT_EQ(only<DropWorker>(effects)[0].worker, 1U);
  const auto batches = only<SendBatch>(effects);
  ASSERT_FALSE(batches.empty());
  EXPECT_EQ(batches[0].worker, 2U);
  EXPECT_EQ(batches[0].first_point(), lost.first_point());
  EXPECT_EQ(batches[0].attempt, 2U);
}

TEST(SchedulerTest, WorkersAreNotLostWhenTheServerItselfDidNotRun) {
  SchedulerBench bench(table_of(4));
  bench.join(1, 1);
  bench.pass(1000, {1});
  bench.now_ms += 60'000;  // the server did not run for a minute
  EXPECT_TRUE(only<DropWorker>(bench.feed(Tick{})).empty());
  EXPECT_EQ(only<DropWorker>(bench.pass(3500)).size(), 1U);
}

TEST(SchedulerTest, ALateResultOfAnOldAttemptIsStoredWhileThePointIsOpen) {
  SchedulerBench bench(table_of(4));
  const auto old = bench.join(1, 1).at(0);
  bench.pass(3250);
  EXPECT_FALSE(bench.scheduler.has_worker(1));
  const auto again = bench.join(2, 1).at(0);
  ASSERT_EQ(again.first_point(), old.first_point());
  bench.join(3, 0);  // the lost worker rejoins as number 3
  const auto late = only<StoreResults>(
      bench.feed(ResultsReceived{3, 1, old.lease, 1, true, 0.1, {{old.first_point(), false}}}));
  EXPECT_EQ(late.at(0).accepted.size(), 1U);
  const auto second = only<StoreResults>(bench.solve(again));
  EXPECT_EQ(second.at(0).accepted.size(), again.count() - 1);
}

TEST(SchedulerTest, ResultsDoNotEndALeaseOfAnotherWorker) {
  SchedulerBench bench(table_of(100));
  const auto batch = bench.join(1, 1).at(0);
  bench.join(2, 0);
  bench.feed(ResultsReceived{2, 1, batch.lease, 1, true, 0.1, {}});
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).leased_points, batch.count());
}

TEST(SchedulerTest, AWorkerThatSaysGoodbyeReturnsItsPointsAtOnce) {
  SchedulerBench bench(table_of(1));
  bench.join(1, 1);
  bench.join(2, 1);
  const auto effects = bench.feed(WorkerLeft{1});
  ASSERT_EQ(only<SendBatch>(effects).size(), 1U);
  EXPECT_EQ(only<SendBatch>(effects)[0].worker, 2U);
}

TEST(SchedulerTest, ABatchThatNeverReachedItsWorkerIsLeasedAgain) {
  SchedulerBench bench(table_of(1));
  const auto batch = bench.join(1, 1).at(0);
  bench.now_ms += 1000;
  // This heartbeat lacks the lease, but the worker may not have received the batch yet.
  EXPECT_TRUE(bench.feed(HeartbeatReceived{1, {}}).empty());
  bench.pass(3000, {1});
  EXPECT_TRUE(bench.feed(HeartbeatReceived{1, {batch.lease}}).empty());
  bench.feed(HeartbeatReceived{1, {}});
  const auto again = only<SendBatch>(bench.feed(CreditGiven{1, 1}));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].attempt, 2U);
}

TEST(SchedulerTest, ACancelledStudyIsWithdrawnAndGetsNoMoreBatches) {
  SchedulerBench bench(table_of(100));
  bench.join(1, 1);
  const auto effects = bench.feed(StudyCancelled{1});
  EXPECT_EQ(only<WithdrawStudy>(effects).size(), 1U);
  EXPECT_TRUE(bench.feed(CreditGiven{1, 10}).empty());
  EXPECT_EQ(bench.scheduler.study(1).leased, 0U);
  EXPECT_TRUE(bench.feed(StudyCancelled{1}).empty());
}

TEST(SchedulerTest, TheDefinitionOfAReopenedStudyIsSentAgain) {
  SchedulerBench bench(table_of(100));
  const auto batch = bench.join(1, 1).at(0);
  bench.feed(StudyCancelled{1});
  bench.feed(CreditGiven{1, 1});
  const auto effects = bench.feed(StudyReopened{1});
  EXPECT_EQ(only<DefineStudy>(effects).size(), 1U);
  ASSERT_EQ(only<SendBatch>(effects).size(), 1U);
  EXPECT_EQ(only<SendBatch>(effects)[0].first_point(), batch.first_point());
}

TEST(SchedulerTest, ResultsOfACancelledStudyAreKept) {
  SchedulerBench bench(table_of(100));
  const auto batch = bench.join(1, 1).at(0);
  bench.feed(StudyCancelled{1});
  bench.solve_and_store(batch);
  EXPECT_EQ(bench.scheduler.study(1).solved(), batch.count());
}

TEST(SchedulerTest, OnlyOpenPointsOfARestoredStudyAreLeased) {
  SchedulerBench bench(trusting());
  IntervalSet completed(0, 5);
  completed.insert(7);
  bench.feed(StudyAdded{1, table_of(10), completed, 2});
  std::set<std::uint64_t> leased;
  for (const auto& batch : bench.join(1, 20)) {
    for (std::uint64_t i = 0; i < batch.count(); ++i) {
      leased.insert(batch.first_point() + i);
    }
  }
  EXPECT_EQ(leased, (std::set<std::uint64_t>{5, 6, 8, 9}));
  EXPECT_EQ(bench.scheduler.study(1).solved(), 4U);
  EXPECT_EQ(bench.scheduler.study(1).failed, 2U);
}

TEST(SchedulerTest, ARestoredStudyWithoutOpenPointsIsFinished) {
  SchedulerBench bench;
  EXPECT_EQ(only<StudyFinished>(bench.feed(StudyAdded{1, table_of(3), IntervalSet(0, 3)})).size(),
            1U);
}

TEST(SchedulerTest, NothingIsLeasedWhileTheDiskAcceptsNothing) {
  SchedulerBench bench(table_of(100));
  bench.feed(DispatchHeld{true});
  EXPECT_TRUE(bench.join(1, 2).empty());
  EXPECT_EQ(only<SendBatch>(bench.feed(DispatchHeld{false})).size(), 2U);
}

TEST(SchedulerTest, EventsOfUnknownWorkersAndStudiesChangeNothing) {
  SchedulerBench bench;
  EXPECT_TRUE(bench.feed(CreditGiven{9, 5}).empty());
  EXPECT_TRUE(bench.feed(HeartbeatReceived{9, {1, 2}}).empty());
  EXPECT_TRUE(bench.feed(WorkerLeft{9}).empty());
  EXPECT_TRUE(bench.feed(WorkerUnreachable{9}).empty());
  EXPECT_TRUE(bench.feed(StudyCancelled{9}).empty());
  EXPECT_TRUE(bench.feed(StudyReopened{9}).empty());
  EXPECT_TRUE(bench.feed(ResultsReceived{9, 9, 9, 9, true, 1.0, {{0, false}}}).empty());
  EXPECT_TRUE(bench.feed(ResultsStored{9, 9, 9, {{0, false}}}).empty());
}

TEST(SchedulerTest, ResultsOfAnUnknownStudyAreAcknowledgedSoThatTheWorkerDropsThem) {
  SchedulerBench bench;
  bench.join(1, 0);
  const auto store =
      only<StoreResults>(bench.feed(ResultsReceived{1, 77, 0, 4, true, 1.0, {{0, false}}}));
  ASSERT_EQ(store.size(), 1U);
  EXPECT_TRUE(store[0].accepted.empty());
  EXPECT_EQ(only<AcknowledgeResults>(bench.feed(ResultsStored{1, 77, 4, {}})).size(), 1U);
}

// ---- Batches that a worker returns unsolved ----

TEST(SchedulerTest, AReturnedBatchIsFreeAtOnceAndCountsAsNoLoss) {
  SchedulerBench bench(table_of(100), trusting());
  const SendBatch batch = only<SendBatch>(bench.join_as("a", 1, 1)).at(0);
  ASSERT_GT(batch.count(), 1U);
  bench.join_as("b", 2, 1000);  // worker 2 gets all other points and waits for more
  // Worker 1 has solved one point of its batch and returns the other points.
  bench.feed(ResultsReceived{1, 1, batch.lease, 1, false, 1e-3, {{batch.first_point(), false}}});
  const auto again = only<SendBatch>(bench.feed(BatchesReturned{1, {batch.lease}}));
  std::uint64_t next = batch.first_point() + 1;
  for (const SendBatch& part : again) {
    EXPECT_EQ(part.worker, 2U);
    EXPECT_EQ(part.first_point(), next);
    EXPECT_EQ(part.attempt, batch.attempt + 1);
    next += part.count();
  }
  EXPECT_EQ(next, batch.first_point() + batch.count());
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).losses, 0U);
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).leased_points, 0U);
}

TEST(SchedulerTest, ResultsAfterTheReturnOfTheirBatchCount) {
  SchedulerBench bench(table_of(1), trusting());
  const SendBatch batch = bench.join(1, 1).at(0);
  bench.feed(BatchesReturned{1, {batch.lease}});
  EXPECT_EQ(only<StoreResults>(bench.feed(ResultsReceived{1, 1, 0, 1, false, 1e-3, {{0, false}}}))
                .at(0)
                .accepted.size(),
            1U);
}

TEST(SchedulerTest, ReturningLeasesOfOthersOrUnknownOnesHasNoEffect) {
  SchedulerBench bench(table_of(100), trusting());
  const SendBatch batch = bench.join(1, 1).at(0);
  const SendBatch other = bench.join(2, 1).at(0);
  bench.feed(BatchesReturned{2, {batch.lease, 0, UINT64_MAX, other.lease, other.lease}});
  bench.feed(BatchesReturned{99, {batch.lease}});
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).leased_points, batch.count());
  EXPECT_EQ(bench.scheduler.worker(2, bench.now_ms).leased_points, 0U);
}

TEST(SchedulerTest, AnImpossiblyFastPaceLeadsToTheLargestBatch) {
  SchedulerBench bench(table_of(1'000'000), trusting());
  SendBatch batch = bench.join(1, 1).at(0);
  for (int i = 0; i < 10; ++i) {
    batch = bench.next_after(batch, 1e-310);
  }
  EXPECT_EQ(batch.count(), SchedulerSettings().largest_batch_points);
}

// ---- Cost of events with many workers and studies, measured in examined workers ----

constexpr WorkerId kWorkers = 1000;

/// Provides a thousand workers that have requested batches while no study is open.
class IdleWorkers : public testing::Test {
 protected:
  IdleWorkers() {
    for (WorkerId worker = 1; worker <= kWorkers; ++worker) {
      scheduler_.handle(WorkerJoined{worker, 1}, now_ms_);
      scheduler_.handle(CreditGiven{worker, 2}, now_ms_);
    }
  }
  std::vector<Effect> add_study() {
    return scheduler_.handle(StudyAdded{2, table_of(100), IntervalSet(0, 1)}, now_ms_);
  }

  Scheduler scheduler_{SchedulerSettings{}};
  std::int64_t now_ms_ = 1'000'000;
};

TEST_F(IdleWorkers, AMessageOfOneWorkerExaminesNoOther) {
  const std::uint64_t before = scheduler_.examined_workers();
  for (WorkerId worker = 1; worker <= kWorkers; ++worker) {
    scheduler_.handle(HeartbeatReceived{worker, {}}, now_ms_);
  }
  EXPECT_LE(scheduler_.examined_workers() - before, kWorkers);
  scheduler_.check_invariants();
}

TEST_F(IdleWorkers, WorkersAreServedInTheOrderOfTheirRequests) {
  scheduler_.handle(HeartbeatReceived{500, {}}, now_ms_);
  EXPECT_EQ(only<SendBatch>(add_study()).at(0).worker, 1U);
}

TEST(ManyStudies, WithoutOpenPointsDoNotSlowDispatch) {
  const auto cost_with = [](StudyId resting) {
    Scheduler scheduler(trusting());
    for (StudyId study = 1; study <= resting; ++study) {
      StudyAdded event{study, table_of(3), study % 2 == 0 ? IntervalSet(0, 3) : IntervalSet()};
      event.paused = study % 2 == 1;
      scheduler.handle(event, 0);
    }
    scheduler.handle(WorkerJoined{1, 1}, 0);
    scheduler.handle(StudyAdded{resting + 1, table_of(1000), {}}, 0);
    const std::uint64_t before = scheduler.examined_workers();
    std::size_t batches = 0;
    for (int i = 0; i < 100; ++i) {
      batches += only<SendBatch>(scheduler.handle(CreditGiven{1, 1}, 0)).size();
      scheduler.handle(Tick{}, i);
    }
    EXPECT_EQ(batches, 100U);
    return scheduler.examined_workers() - before;
  };
  EXPECT_EQ(cost_with(10'000), cost_with(10));
}

}  // namespace
}  // namespace oblique::server
