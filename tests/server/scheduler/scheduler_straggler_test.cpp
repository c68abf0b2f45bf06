#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "server/scheduler/scheduler.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

/// Workers 1 and 2, of which the first holds all four points in one batch and the second waits.
class StragglerTest : public testing::Test {
 protected:
  StragglerTest() : bench_(settings()) {
    bench_.feed(StudyAdded{1, table_of(4), {}});
    first_ = bench_.join(1, 1).at(0);
    EXPECT_EQ(first_.count(), 4U);
    EXPECT_TRUE(bench_.join(2, 1).empty());
  }

  static SchedulerSettings settings() {
    SchedulerSettings settings;
    settings.tail_batches_per_thread = 0;
    return settings;
  }

  /// The batch that worker 2 gets once the first one straggles.
  SendBatch second() {
    const auto batches = only<SendBatch>(bench_.pass(1500, {1, 2}));
    EXPECT_EQ(batches.size(), 1U);
    return batches.at(0);
  }

  /// Answers to some points of a batch, which go on the disk.
  std::vector<Effect> answer(const SendBatch& batch, const std::vector<std::uint64_t>& points,
                             bool done) {
    ResultsReceived event{batch.worker, batch.study, batch.lease, ++bench_.sequence, done, 0.0, {}};
    for (const std::uint64_t point : points) {
      event.outcomes.push_back({point, false});
    }
    auto effects = bench_.feed(event);
    for (const StoreResults& store : only<StoreResults>(effects)) {
      ResultsStored stored{store.worker, store.study, store.sequence, {}};
      for (const std::size_t index : store.accepted) {
        stored.outcomes.push_back(event.outcomes.at(index));
      }
      accepted_ += stored.outcomes.size();
      const auto more = bench_.feed(stored);
      effects.insert(effects.end(), more.begin(), more.end());
    }
    return effects;
  }

  SchedulerBench bench_;
  SendBatch first_{};
  std::size_t accepted_ = 0;
};

TEST_F(StragglerTest, ABatchThatTakesTooLongIsGivenToASecondWorkerToo) {
  EXPECT_TRUE(only<SendBatch>(bench_.pass(750, {1, 2})).empty()) << "too early";
  const SendBatch batch = second();
  EXPECT_EQ(batch.worker, 2U);
  EXPECT_EQ(batch.first_point(), 0U);
  EXPECT_EQ(batch.count(), 4U);
  EXPECT_EQ(batch.attempt, 2U);
  EXPECT_EQ(bench_.scheduler.study(1).leased, 4U) << "points count once";
}

TEST_F(StragglerTest, OnlyWhatIsLeftOfTheBatchGoesToTheSecondWorker) {
  answer(first_, {0, 1}, false);
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
  EXPECT_EQ(released[0].lease, first_.lease);
  EXPECT_EQ(accepted_, 4U);
  answer(first_, {0, 1, 2, 3}, true);
  EXPECT_EQ(accepted_, 4U) << "what comes late is stored once only";
}

TEST_F(StragglerTest, TheStragglerMayWinToo) {
  const SendBatch batch = second();
  answer(batch, {0}, false);
  const auto released = only<ReleaseBatch>(answer(first_, {0, 1, 2, 3}, true));
  ASSERT_EQ(released.size(), 1U);
  EXPECT_EQ(released[0].worker, 2U);
  EXPECT_EQ(accepted_, 4U);
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

TEST_F(StragglerTest, AWorkerDoesNotGetItsOwnBatchTwiceNorAThirdWorkerOne) {
  second();
  bench_.feed(CreditGiven{1, 1});
  bench_.join(3, 1);
  EXPECT_TRUE(only<SendBatch>(bench_.pass(20'000, {1, 2, 3})).empty());
}

TEST_F(StragglerTest, ABatchOfSlowPointsIsNotTakenForAStraggler) {
  // Worker 2 is known to need 10 s a point.
  SchedulerSettings one = settings();
  one.first_batch_points = 1;
  SchedulerBench slow(one);
  slow.feed(StudyAdded{1, table_of(2), {}});
  slow.join(1, 1);
  const auto batch = slow.join(2, 1).at(0);
  slow.pass(10'000, {1, 2});
  slow.solve_and_store(batch, 10.0);
  slow.feed(CreditGiven{2, 1});
  EXPECT_TRUE(only<SendBatch>(slow.pass(25'000, {1, 2})).empty());
  EXPECT_EQ(only<SendBatch>(slow.pass(10'000, {1, 2})).size(), 1U);
}

TEST_F(StragglerTest, ABatchThatWaitsBehindAnotherOfItsWorkerIsTakenOver) {
  SchedulerSettings one = settings();
  one.first_batch_points = 1;
  SchedulerBench bench(one);
  bench.feed(StudyAdded{1, table_of(3), {}});
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

TEST_F(StragglerTest, ABatchThatKillsWorkersIsFoundAlthoughTwoOfThemHadIt) {
  second();
  bench_.feed(WorkerUnreachable{1});
  bench_.join(3, 1);
  EXPECT_TRUE(only<SendBatch>(bench_.pass(5000, {2, 3})).empty()) << "not given to a third worker";
  const auto probe = only<SendProbe>(bench_.feed(WorkerUnreachable{2}));
  // Two workers were lost: the points are suspect now, and go to a worker that has proven itself.
  ASSERT_EQ(probe.size(), 1U);
  EXPECT_EQ(only<SendBatch>(bench_.solve_probe(probe[0])).at(0).count(), 1U) << "split";
}

TEST_F(StragglerTest, AFailureForgottenUnderARunningLeaseIsNotGivenBackWhileItsNewLeaseLasts) {
  ResultsReceived failed{1, 1, first_.lease, 1, false, 0.0, {{2, true}}};
  bench_.feed(failed);
  bench_.feed(ResultsStored{1, 1, 1, {{2, true}}});
  IntervalSet forgotten;
  forgotten.insert(2);
  const auto again = only<SendBatch>(bench_.feed(FailuresForgotten{1, forgotten}));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].worker, 2U);
  bench_.feed(WorkerLeft{1});
  EXPECT_EQ(bench_.scheduler.study(1).leased, 1U);
  bench_.feed(WorkerLeft{2});
  EXPECT_EQ(bench_.scheduler.study(1).leased, 0U);
}

}  // namespace
}  // namespace oblique::server
