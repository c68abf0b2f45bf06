#include "server/scheduler/scheduler.h"

#include <algorithm>
#include <deque>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

TEST(SchedulerTest, AWorkerWithCreditGetsTheDefinitionAndThenItsBatch) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(10), {}});
  bench.feed(WorkerJoined{5, 1});
  const auto effects = bench.feed(CreditGiven{5, 1});
  ASSERT_EQ(effects.size(), 2U);
  EXPECT_TRUE(std::holds_alternative<DefineStudy>(effects[0]));
  const auto batch = std::get<SendBatch>(effects[1]);
  EXPECT_EQ(batch.first_point(), 0U);
  EXPECT_EQ(batch.attempt, 1U);
}

TEST(SchedulerTest, ADefinitionIsSentOnce) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), {}});
  bench.feed(WorkerJoined{5, 1});
  EXPECT_EQ(only<DefineStudy>(bench.feed(CreditGiven{5, 3})).size(), 1U);
  EXPECT_TRUE(only<DefineStudy>(bench.feed(CreditGiven{5, 3})).empty());
}

TEST(SchedulerTest, AWorkerGetsNoMoreBatchesThanItAskedFor) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  EXPECT_EQ(bench.join(5, 3).size(), 3U);
  EXPECT_TRUE(bench.pass(1000, {5}).empty());
}

TEST(SchedulerTest, ABatchRunsAcrossBlocksOfOnePointEach) {
  constexpr std::uint64_t kBlocks = 1000;
  const std::vector<protocol::Axis> point{
      protocol::listed("H", {1.0}), protocol::listed("mu", {0.4}), protocol::listed("e", {1.0})};
  SchedulerBench bench;
  bench.feed(StudyAdded{
      1, std::make_shared<const protocol::PointTable>(protocol::recipe_of({kBlocks, point})), {}});
  std::deque<SendBatch> held;
  std::uint64_t batches = 0;
  for (const auto& batch : bench.join(1, 1)) {
    held.push_back(batch);
  }
  while (!held.empty()) {
    ++batches;
    bench.solve_and_store(held.front());
    held.pop_front();
    for (const auto& batch : only<SendBatch>(bench.feed(CreditGiven{1, 1}))) {
      held.push_back(batch);
    }
  }
  EXPECT_LT(batches, kBlocks / 10);
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

TEST(SchedulerTest, AStudyOfABillionPointsCostsNoMoreThanASmallOne) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1'000'000'000), {}});
  std::deque<SendBatch> held;
  for (const auto& batch : bench.join(1, 2)) {
    held.push_back(batch);
  }
  for (int i = 0; i < 50; ++i) {
    const auto batch = held.front();
    held.pop_front();
    bench.solve_and_store(batch);
    for (const auto& next : only<SendBatch>(bench.feed(CreditGiven{1, 1}))) {
      held.push_back(next);
    }
  }
  EXPECT_EQ(bench.scheduler.study(1).points, 1'000'000'000U);
}

TEST(SchedulerTest, BatchesGrowToTheWorkThatWasAimedAt) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  auto batch = bench.join(1, 1).at(0);
  EXPECT_LE(batch.count(), 4U);
  for (int i = 0; i < 10; ++i) {
    bench.solve_and_store(batch, 1e-3 * static_cast<double>(batch.count()));
    batch = only<SendBatch>(bench.feed(CreditGiven{1, 1})).at(0);
  }
  EXPECT_EQ(batch.count(), 100U);  // 0.1 s at 1 ms a point
}

TEST(SchedulerTest, TheTailGoesOutInEverSmallerBatches) {
  SchedulerSettings settings;
  settings.shortest_batch_s = 0.0;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(2000), {}});
  std::deque<SendBatch> held;
  for (const WorkerId worker : {1U, 2U, 3U, 4U}) {
    for (const auto& batch : bench.join(worker, 1)) {
      held.push_back(batch);
    }
  }
  std::vector<std::uint64_t> sizes;
  while (!held.empty()) {
    const auto batch = held.front();
    held.pop_front();
    sizes.push_back(batch.count());
    bench.solve_and_store(batch, 1e-5 * static_cast<double>(batch.count()));
    for (const auto& next : only<SendBatch>(bench.feed(CreditGiven{batch.worker, 1}))) {
      held.push_back(next);
    }
  }
  const auto largest = std::max_element(sizes.begin(), sizes.end());
  EXPECT_GT(*largest, 50U);
  EXPECT_EQ(sizes.back(), 1U);
  EXPECT_TRUE(std::is_sorted(largest, sizes.end(), std::greater<>()));
}

TEST(SchedulerTest, ResultsAreAcknowledgedOnlyAfterTheyAreStored) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
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

TEST(SchedulerTest, ADuplicateResultIsNotKeptButStillAcknowledged) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(4), {}});
  const auto batch = bench.join(7, 1).at(0);
  bench.solve_and_store(batch);
  const auto again = only<StoreResults>(bench.solve(batch));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_TRUE(again[0].accepted.empty());
  EXPECT_EQ(only<AcknowledgeResults>(bench.feed(ResultsStored{7, 1, 2, {}})).size(), 1U);
  EXPECT_EQ(bench.scheduler.study(1).solved(), batch.count());
}

TEST(SchedulerTest, ADuplicateInsideOneMessageIsKeptOnce) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(4), {}});
  bench.join(7, 1);
  const auto store = only<StoreResults>(
      bench.feed(ResultsReceived{7, 1, 0, 1, false, 0.1, {{2, false}, {2, true}}}));
  EXPECT_EQ(store.at(0).accepted, std::vector<std::size_t>{0});
}

TEST(SchedulerTest, PointsOutsideTheStudyAreDropped) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(4), {}});
  bench.join(7, 1);
  const auto store = only<StoreResults>(
      bench.feed(ResultsReceived{7, 1, 0, 1, false, 0.1, {{4, false}, {UINT64_MAX, false}}}));
  EXPECT_TRUE(store.at(0).accepted.empty());
}

TEST(SchedulerTest, ASilentWorkersPointsGoToAnotherWithinThreeSeconds) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(4), {}});
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

TEST(SchedulerTest, AWorkerThatSpeaksIsNotLost) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(4), {}});
  bench.join(1, 1);
  EXPECT_TRUE(only<DropWorker>(bench.pass(60'000, {1})).empty());
}

TEST(SchedulerTest, WorkersAreNotBlamedWhenTheServerItselfStoodStill) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(4), {}});
  bench.join(1, 1);
  bench.pass(1000, {1});
  bench.now_ms += 60'000;  // the server was stopped and continues
  EXPECT_TRUE(only<DropWorker>(bench.feed(Tick{})).empty());
  EXPECT_EQ(only<DropWorker>(bench.pass(3500)).size(), 1U);
}

TEST(SchedulerTest, ALateResultOfAnOldAttemptIsKeptWhileThePointIsOpen) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(4), {}});
  const auto old = bench.join(1, 1).at(0);
  bench.pass(3250);
  EXPECT_FALSE(bench.scheduler.knows_worker(1));
  const auto again = bench.join(2, 1).at(0);
  ASSERT_EQ(again.first_point(), old.first_point());
  bench.join(3, 0);  // the lost worker with a new number
  const auto late = only<StoreResults>(
      bench.feed(ResultsReceived{3, 1, old.lease, 1, true, 0.1, {{old.first_point(), false}}}));
  EXPECT_EQ(late.at(0).accepted.size(), 1U);
  const auto second = only<StoreResults>(bench.solve(again));
  EXPECT_EQ(second.at(0).accepted.size(), again.count() - 1);
}

TEST(SchedulerTest, AStrangersLeaseIsNotClosedByResultsThatNameIt) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), {}});
  const auto batch = bench.join(1, 1).at(0);
  bench.join(2, 0);
  bench.feed(ResultsReceived{2, 1, batch.lease, 1, true, 0.1, {}});
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).leased_points, batch.count());
}

TEST(SchedulerTest, AWorkerThatSaysGoodbyeReturnsItsPointsAtOnce) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
  bench.join(1, 1);
  bench.join(2, 1);
  const auto effects = bench.feed(WorkerLeft{1});
  ASSERT_EQ(only<SendBatch>(effects).size(), 1U);
  EXPECT_EQ(only<SendBatch>(effects)[0].worker, 2U);
}

TEST(SchedulerTest, AnUnreachableWorkerIsDroppedAtOnce) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
  bench.join(1, 1);
  EXPECT_EQ(only<DropWorker>(bench.feed(WorkerUnreachable{1})).size(), 1U);
  EXPECT_EQ(bench.scheduler.workers(), 0U);
}

TEST(SchedulerTest, ABatchThatNeverReachedItsWorkerIsLeasedAgain) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
  const auto batch = bench.join(1, 1).at(0);
  bench.now_ms += 1000;
  EXPECT_TRUE(bench.feed(HeartbeatReceived{1, {}}).empty());  // it may be on its way
  bench.pass(3000, {1});
  EXPECT_TRUE(bench.feed(HeartbeatReceived{1, {batch.lease}}).empty());
  bench.feed(HeartbeatReceived{1, {}});
  const auto again = only<SendBatch>(bench.feed(CreditGiven{1, 1}));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].attempt, 2U);
}

TEST(SchedulerTest, ACancelledStudyIsWithdrawnAndGetsNoMoreBatches) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), {}});
  bench.join(1, 1);
  const auto effects = bench.feed(StudyCancelled{1});
  EXPECT_EQ(only<WithdrawStudy>(effects).size(), 1U);
  EXPECT_TRUE(bench.feed(CreditGiven{1, 10}).empty());
  EXPECT_EQ(bench.scheduler.study(1).leased, 0U);
  EXPECT_TRUE(bench.feed(StudyCancelled{1}).empty());
}

TEST(SchedulerTest, ACancelledStudyThatIsReopenedGoesOnWithANewDefinition) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), {}});
  const auto batch = bench.join(1, 1).at(0);
  bench.feed(StudyCancelled{1});
  bench.feed(CreditGiven{1, 1});
  const auto effects = bench.feed(StudyReopened{1});
  EXPECT_EQ(only<DefineStudy>(effects).size(), 1U);
  ASSERT_EQ(only<SendBatch>(effects).size(), 1U);
  EXPECT_EQ(only<SendBatch>(effects)[0].first_point(), batch.first_point());
}

TEST(SchedulerTest, ResultsOfACancelledStudyAreKept) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), {}});
  const auto batch = bench.join(1, 1).at(0);
  bench.feed(StudyCancelled{1});
  bench.solve_and_store(batch);
  EXPECT_EQ(bench.scheduler.study(1).solved(), batch.count());
}

TEST(SchedulerTest, ARestoredStudyHandsOutOnlyWhatIsOpen) {
  SchedulerBench bench(trusting());
  IntervalSet settled(0, 5);
  settled.insert(7);
  bench.feed(StudyAdded{1, table_of(10), settled, 2});
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

TEST(SchedulerTest, StudiesTakeTurns) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  bench.feed(StudyAdded{2, table_of(1'000'000), {}});
  std::vector<StudyId> order;
  for (const auto& batch : bench.join(1, 4)) {
    order.push_back(batch.study);
  }
  EXPECT_EQ(order, (std::vector<StudyId>{1, 2, 1, 2}));
}

TEST(SchedulerTest, NothingIsHandedOutWhileTheDiskTakesNothing) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), {}});
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

TEST(SchedulerTest, ResultsOfAnUnknownStudyAreAcknowledgedSoThatTheWorkerForgetsThem) {
  SchedulerBench bench;
  bench.join(1, 0);
  const auto store =
      only<StoreResults>(bench.feed(ResultsReceived{1, 77, 0, 4, true, 1.0, {{0, false}}}));
  ASSERT_EQ(store.size(), 1U);
  EXPECT_TRUE(store[0].accepted.empty());
  EXPECT_EQ(only<AcknowledgeResults>(bench.feed(ResultsStored{1, 77, 4, {}})).size(), 1U);
}

}  // namespace
}  // namespace oblique::server
