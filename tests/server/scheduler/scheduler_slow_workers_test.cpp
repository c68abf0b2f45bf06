// Tests of slow workers: other workers get their points, but no worker counts as lost.
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

constexpr std::int64_t kMinute_ms = 60'000;

TEST(SchedulerStall, AStudyEndsDespiteWorkersThatOnlySendHeartbeats) {
  SchedulerBench bench(table_of(2000));
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

/// Provides a study of four points, all leased to worker 1.
class StallTest : public testing::Test {
 protected:
  StallTest() { EXPECT_EQ(batch_.count(), 4U); }

  static SchedulerSettings settings() {
    SchedulerSettings settings;
    settings.tail_batches_per_thread = 0;
    return settings;
  }

  SchedulerBench bench_{table_of(4), settings()};
  SendBatch batch_ = bench_.join(1, 1).at(0);
};

TEST_F(StallTest, AMinuteWithoutAResultEndsTheLeasesOfAWorker) {
  EXPECT_TRUE(only<ReleaseBatch>(bench_.pass(kMinute_ms, {1})).empty())
      << "the time limit is not yet reached";
  EXPECT_EQ(bench_.scheduler.study(1).leased, 4U);
  const auto effects = bench_.pass(1000, {1});
  const auto released = only<ReleaseBatch>(effects);
  ASSERT_EQ(released.size(), 1U);
  EXPECT_EQ(released[0].lease, batch_.lease);
  EXPECT_TRUE(only<DropWorker>(effects).empty());
  EXPECT_EQ(bench_.scheduler.study(1).leased, 0U);
  EXPECT_EQ(bench_.scheduler.worker(1, bench_.now_ms).state, WorkerState::kStalled);
}

TEST_F(StallTest, PointsOfStalledWorkersAreNotSuspect) {
  for (WorkerId worker = 2; worker <= 20; ++worker) {
    EXPECT_TRUE(only<StoreFailure>(bench_.pass(kMinute_ms + 1000, {worker - 1})).empty());
    bench_.feed(WorkerLeft{worker - 1});
    const auto batches = bench_.join(worker, 1);
    ASSERT_EQ(batches.size(), 1U);
    EXPECT_EQ(batches[0].count(), 4U) << "the points are not suspect, so they are in one batch";
    EXPECT_EQ(batches[0].attempt, worker);
  }
}

TEST_F(StallTest, LateResultsOfAStalledWorkerAreStoredOnce) {
  bench_.pass(kMinute_ms + 1000, {1});
  const auto again = bench_.join(2, 1);
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(only<StoreResults>(bench_.solve_and_store(batch_)).at(0).accepted.size(), 4U);
  EXPECT_NE(bench_.scheduler.worker(1, bench_.now_ms).state, WorkerState::kStalled)
      << "the worker is only slow";
  EXPECT_TRUE(only<StoreResults>(bench_.solve_and_store(again[0])).at(0).accepted.empty());
  EXPECT_EQ(bench_.scheduler.study(1).solved(), 4U);
}

TEST_F(StallTest, AWorkerThatDeliversAResultInTimeKeepsItsBatch) {
  for (std::uint64_t point = 0; point < 3; ++point) {
    bench_.pass(kMinute_ms - 1000, {1});
    bench_.feed(ResultsReceived{1, 1, batch_.lease, point + 1, false, 50.0, {{point, false}}});
  }
  EXPECT_EQ(bench_.scheduler.study(1).leased, 1U);
}

TEST_F(StallTest, NoWorkerStallsWhileTheDatabaseAcceptsNothing) {
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

TEST_F(StallTest, AStalledWorkerGetsTwoBatchesAfterItStoredSomethingOrAMinute) {
  for (const bool stores : {true, false}) {
    bench_ = SchedulerBench(table_of(1'000'000), settings());
    batch_ = bench_.join(1, 1).at(0);
    bench_.feed(CreditGiven{1, 1024});
    EXPECT_TRUE(only<SendBatch>(bench_.pass(kMinute_ms + 30'000, {1})).empty());
    EXPECT_EQ(only<SendBatch>(stores ? bench_.solve(batch_) : bench_.pass(31'000, {1})).size(), 2U);
  }
}

TEST(SchedulerStall, SlowPointsGetAMultipleOfTheFastestWorkersTime) {
  SchedulerSettings settings = trusting();
  settings.first_batch_points = 1;
  SchedulerBench bench(table_of(100), settings);
  const SendBatch quick = bench.join(1, 1).at(0);
  const SendBatch slow = bench.join(2, 1).at(0);
  bench.pass(10'000, {1, 2});
  bench.solve_and_store(quick, 10.0 * static_cast<double>(quick.count()));
  // The quick worker needs 10 s per point, so 80 s for the eight points that a thread solves
  // together. A worker that stores nothing for ten times as long counts as stalled.
  bench.pass(780'000, {1, 2});
  EXPECT_EQ(bench.scheduler.worker(2, bench.now_ms).leased_points, slow.count());
  bench.pass(20'000, {1, 2});
  EXPECT_EQ(bench.scheduler.worker(2, bench.now_ms).leased_points, 0U);
}

/// Provides the study of StallTest and a worker 2 that waits for a batch.
class StragglerTest : public StallTest {
 protected:
  StragglerTest() { EXPECT_TRUE(bench_.join(2, 1).empty()); }

  /// Returns the batch that worker 2 gets when worker 1 is late.
  SendBatch second() {
    const auto batches = only<SendBatch>(bench_.pass(1500, {1, 2}));
    EXPECT_EQ(batches.size(), 1U);
    return batches.at(0);
  }

  /// Passes results of some points of a batch to the scheduler and reports them as stored.
  std::vector<Effect> answer(const SendBatch& batch, const std::vector<std::uint64_t>& points,
                             bool done) {
    ResultsReceived event{batch.worker, batch.study, batch.lease, ++bench_.sequence, done, 0.0, {}};
    for (const std::uint64_t point : points) {
      event.outcomes.push_back({point, false});
    }
    return bench_.store(event);
  }
};

TEST_F(StragglerTest, ABatchThatTakesTooLongIsGivenToASecondWorkerToo) {
  EXPECT_TRUE(only<SendBatch>(bench_.pass(750, {1, 2})).empty())
      << "the time limit is not yet reached";
  const SendBatch batch = second();
  EXPECT_EQ(batch.worker, 2U);
  EXPECT_EQ(batch.first_point(), 0U);
  EXPECT_EQ(batch.count(), 4U);
  EXPECT_EQ(batch.attempt, 2U);
  EXPECT_EQ(bench_.scheduler.study(1).leased, 4U) << "points with two leases count once";
}

TEST_F(StragglerTest, OnlyOpenPointsOfTheBatchGoToTheSecondWorker) {
  answer(batch_, {0, 1}, false);
  const SendBatch batch = second();
  EXPECT_EQ(batch.first_point(), 2U);
  EXPECT_EQ(batch.count(), 2U);
}

TEST_F(StragglerTest, TheFirstAnswerWinsAndTheOtherWorkerIsReleased) {
  const SendBatch batch = second();
  const auto effects = answer(batch, {0, 1, 2, 3}, true);
  EXPECT_EQ(only<StudyFinished>(effects).size(), 1U);
  const auto released = only<ReleaseBatch>(effects);
  ASSERT_EQ(released.size(), 1U);
  EXPECT_EQ(released[0].worker, 1U);
  EXPECT_EQ(released[0].lease, batch_.lease);
  const auto late = only<StoreResults>(answer(batch_, {0, 1, 2, 3}, true));
  EXPECT_TRUE(late.at(0).accepted.empty()) << "a late result was stored again";
}

TEST_F(StragglerTest, TheSlowWorkerMayAnswerFirst) {
  const SendBatch batch = second();
  answer(batch, {0}, false);
  const auto released = only<ReleaseBatch>(answer(batch_, {0, 1, 2, 3}, true));
  ASSERT_EQ(released.size(), 1U);
  EXPECT_EQ(released[0].worker, 2U);
  EXPECT_EQ(bench_.scheduler.study(1).solved(), 4U);
}

TEST_F(StragglerTest, PointsStayLeasedWhileOneOfTheTwoWorkersHasThem) {
  const SendBatch batch = second();
  bench_.feed(WorkerUnreachable{1});
  EXPECT_EQ(bench_.scheduler.study(1).leased, 4U);
  bench_.feed(WorkerLeft{2});
  EXPECT_EQ(bench_.scheduler.study(1).leased, 0U);
  EXPECT_EQ(bench_.join(3, 1).at(0).count(), 4U);
  EXPECT_EQ(batch.worker, 2U);
}

TEST_F(StragglerTest, ABatchGoesToAtMostTwoDifferentWorkers) {
  second();
  bench_.feed(CreditGiven{1, 1});
  bench_.join(3, 1);
  EXPECT_TRUE(only<SendBatch>(bench_.pass(20'000, {1, 2, 3})).empty());
}

TEST_F(StragglerTest, ABatchOfSlowPointsIsNotAStraggler) {
  // Worker 2 needs 10 s per point.
  SchedulerSettings one = settings();
  one.first_batch_points = 1;
  SchedulerBench slow(table_of(2), one);
  slow.join(1, 1);
  const auto batch = slow.join(2, 1).at(0);
  slow.pass(10'000, {1, 2});
  slow.solve_and_store(batch, 10.0);
  slow.feed(CreditGiven{2, 1});
  EXPECT_TRUE(only<SendBatch>(slow.pass(25'000, {1, 2})).empty());
  EXPECT_EQ(only<SendBatch>(slow.pass(10'000, {1, 2})).size(), 1U);
}

TEST_F(StragglerTest, ABatchThatWaitsForAnotherOfItsWorkerGoesToASecondWorker) {
  SchedulerSettings one = settings();
  one.first_batch_points = 1;
  SchedulerBench bench(table_of(3), one);
  bench.feed(WorkerJoined{1, 1});
  bench.feed(CreditGiven{1, 1});
  const auto batch = bench.join(2, 1).at(0);
  bench.now_ms += 10;
  const auto waits = only<SendBatch>(bench.feed(CreditGiven{1, 1})).at(0);
  bench.pass(2000, {1, 2});
  bench.solve_and_store(batch, 2.0);
  bench.feed(CreditGiven{2, 1});
  const auto taken = only<SendBatch>(bench.pass(500, {1, 2}));
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].first_point(), waits.first_point());
}

TEST_F(StragglerTest, ACrashIsReportedAlthoughASecondWorkerHasTheBatch) {
  SchedulerBench bench(table_of(4), settings());
  const SendBatch first = only<SendBatch>(bench.join_as("one", 1, 1)).at(0);
  bench.join(2, 1);
  const SendBatch twin = only<SendBatch>(bench.pass(1500, {1, 2})).at(0);
  ASSERT_EQ(twin.first_point(), first.first_point());
  bench.feed(WorkerUnreachable{1});
  const auto effects = bench.join_as("next", 3, 1, EndedProcess{"one", 11, {{1, 2}}});
  EXPECT_EQ(only<ReleaseBatch>(effects).at(0).lease, twin.lease);
  const auto alone = only<SendBatch>(effects);
  EXPECT_EQ(alone.at(0).first_point(), 2U);
  EXPECT_EQ(alone.at(0).count(), 1U);
}

TEST_F(StragglerTest, ForgettingAFailureEndsALeaseThatContainsThePoint) {
  bench_.store(ResultsReceived{1, 1, batch_.lease, 1, false, 0.0, {{2, true}}});
  const auto effects = bench_.feed(FailuresForgotten{1, IntervalSet(2, 3)});
  ASSERT_EQ(only<ReleaseBatch>(effects).size(), 1U);
  EXPECT_EQ(only<ReleaseBatch>(effects)[0].lease, batch_.lease);
  const auto again = only<SendBatch>(effects);
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].worker, 2U);
  bench_.feed(WorkerLeft{1});
  EXPECT_EQ(bench_.scheduler.study(1).leased, again[0].count());
}

TEST_F(StragglerTest, ACancellationReturnsThePointsOfBothLeasesOfABatch) {
  second();
  ASSERT_EQ(bench_.scheduler.worker(2, bench_.now_ms).leased_points, batch_.count());
  EXPECT_EQ(only<WithdrawStudy>(bench_.feed(StudyCancelled{1})).size(), 2U);
  EXPECT_EQ(bench_.scheduler.study(1).leased, 0U);
  bench_.feed(CreditGiven{1, 1});
  EXPECT_EQ(only<SendBatch>(bench_.feed(StudyReopened{1})).size(), 1U);
}

}  // namespace
}  // namespace oblique::server
