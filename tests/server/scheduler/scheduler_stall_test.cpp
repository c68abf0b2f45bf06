// Workers that hold batches and store nothing: others get the points, and nothing counts as lost.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/scheduler/scheduler.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

constexpr std::int64_t kMinute_ms = 60'000;

TEST(SchedulerStall, AStudyEndsBesideWorkersThatTakeCreditsAndOnlySendHeartbeats) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(2000), {}});
  std::vector<Effect> effects;
  for (const WorkerId idle : {1U, 2U}) {
    for (const SendBatch& batch : bench.join(idle, 2)) {
      bench.solve_and_store(batch);
    }
  }
  for (const WorkerId idle : {1U, 2U}) {
    bench.feed(CreditGiven{idle, 1024});
  }
  SchedulerBench::append(effects, bench.join_as("sound", 3, 2));
  bool is_finished = false;
  for (int step = 0; step < 40'000 && !is_finished; ++step) {
    std::vector<Effect> next = bench.pass(250, {1, 2, 3});
    for (const SendProbe& probe : only<SendProbe>(effects)) {
      SchedulerBench::append(next, bench.solve_probe(probe));  // the idle ones solve these, too
    }
    for (const SendBatch& batch : only<SendBatch>(effects)) {
      if (batch.worker == 3) {
        SchedulerBench::append(next, bench.solve_and_store(batch));
        SchedulerBench::append(next, bench.feed(CreditGiven{3, 1}));
      }
    }
    EXPECT_TRUE(only<StoreFailure>(next).empty());
    is_finished = !only<StudyFinished>(next).empty();
    effects = std::move(next);
  }
  EXPECT_TRUE(is_finished) << bench.scheduler.study(1).leased << " points are still leased";
}

/// Worker 1 holds the only four points, and worker 2 waits.
class StallTest : public testing::Test {
 protected:
  StallTest() : bench_(settings()) {
    bench_.feed(StudyAdded{1, table_of(4), {}});
    batch_ = bench_.join(1, 1).at(0);
    EXPECT_EQ(batch_.count(), 4U);
  }

  static SchedulerSettings settings() {
    SchedulerSettings settings;
    settings.tail_batches_per_thread = 0;
    return settings;
  }

  SchedulerBench bench_;
  SendBatch batch_{};
};

TEST_F(StallTest, AMinuteWithoutAResultEndsTheLeasesOfAWorker) {
  EXPECT_TRUE(only<ReleaseBatch>(bench_.pass(kMinute_ms, {1})).empty()) << "too early";
  EXPECT_EQ(bench_.scheduler.study(1).leased, 4U);
  const auto effects = bench_.pass(1000, {1});
  const auto released = only<ReleaseBatch>(effects);
  ASSERT_EQ(released.size(), 1U);
  EXPECT_EQ(released[0].lease, batch_.lease);
  EXPECT_TRUE(only<DropWorker>(effects).empty());
  EXPECT_EQ(bench_.scheduler.study(1).leased, 0U);
  EXPECT_TRUE(bench_.scheduler.worker(1, bench_.now_ms).is_set_aside);
}

TEST_F(StallTest, ItsPointsAreNotSuspectHoweverManyWorkersStallWithThem) {
  for (WorkerId worker = 2; worker <= 20; ++worker) {
    EXPECT_TRUE(only<StoreFailure>(bench_.pass(kMinute_ms + 1000, {worker - 1})).empty());
    bench_.feed(WorkerLeft{worker - 1});
    const auto batches = bench_.join(worker, 1);
    ASSERT_EQ(batches.size(), 1U);
    EXPECT_EQ(batches[0].count(), 4U) << "they go out together";
    EXPECT_EQ(batches[0].attempt, worker);
  }
}

TEST_F(StallTest, WhatItSendsLateIsStoredOnce) {
  bench_.pass(kMinute_ms + 1000, {1});
  const auto again = bench_.join(2, 1);
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(only<StoreResults>(bench_.solve_and_store(batch_)).at(0).accepted.size(), 4U);
  EXPECT_FALSE(bench_.scheduler.worker(1, bench_.now_ms).is_set_aside) << "it was slow";
  EXPECT_TRUE(only<StoreResults>(bench_.solve_and_store(again[0])).at(0).accepted.empty());
  EXPECT_EQ(bench_.scheduler.study(1).solved(), 4U);
}

TEST_F(StallTest, AWorkerThatStoresSomethingInTimeKeepsItsBatch) {
  for (std::uint64_t point = 0; point < 3; ++point) {
    bench_.pass(kMinute_ms - 1000, {1});
    bench_.feed(ResultsReceived{1, 1, batch_.lease, point + 1, false, 50.0, {{point, false}}});
  }
  EXPECT_EQ(bench_.scheduler.study(1).leased, 1U);
}

TEST_F(StallTest, WhileTheDatabaseTakesNothingNoWorkerStalls) {
  bench_.feed(DispatchHeld{true});
  bench_.pass(10 * kMinute_ms, {1});
  bench_.feed(DispatchHeld{false});
  bench_.pass(kMinute_ms, {1});
  EXPECT_EQ(bench_.scheduler.study(1).leased, 4U);
}

TEST_F(StallTest, TimeInWhichTheServerDidNotRunDoesNotCount) {
  bench_.pass(1000, {1});
  bench_.now_ms += 10 * kMinute_ms;
  bench_.feed(CreditGiven{1, 0});
  bench_.pass(kMinute_ms / 2, {1});
  EXPECT_EQ(bench_.scheduler.study(1).leased, 4U);
}

TEST_F(StallTest, AfterThatItGetsAProbeAndThenTwoBatchesAgain) {
  bench_.feed(StudyAdded{2, table_of(1'000'000), {}});
  bench_.feed(CreditGiven{1, 1024});
  const auto probe = only<SendProbe>(bench_.pass(kMinute_ms + 1000, {1}));
  ASSERT_EQ(probe.size(), 1U);
  EXPECT_TRUE(only<SendBatch>(bench_.pass(kMinute_ms, {1})).empty()) << "it solves nothing";
  EXPECT_EQ(only<SendBatch>(bench_.solve_probe(probe[0])).size(), 2U);
}

TEST(SchedulerStall, SlowPointsGetAMultipleOfTheTimeThatTheFastestWorkerNeeds) {
  SchedulerSettings settings = trusting();
  settings.first_batch_points = 1;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(100), {}});
  const SendBatch quick = bench.join(1, 1).at(0);
  const SendBatch slow = bench.join(2, 1).at(0);
  bench.pass(10'000, {1, 2});
  bench.solve_and_store(quick, 10.0 * static_cast<double>(quick.count()));
  // Ten times what eight points side by side take.
  bench.pass(780'000, {1, 2});
  EXPECT_EQ(bench.scheduler.worker(2, bench.now_ms).leased_points, slow.count());
  bench.pass(20'000, {1, 2});
  EXPECT_EQ(bench.scheduler.worker(2, bench.now_ms).leased_points, 0U);
}

}  // namespace
}  // namespace oblique::server
