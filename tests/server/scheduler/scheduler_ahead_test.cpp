// A study of a higher priority than all that a worker holds.
#include <gtest/gtest.h>

#include "server/scheduler/scheduler.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

constexpr StudyId kSweep = 1;
constexpr StudyId kUrgent = 2;

/// A worker that has solved something holds two batches of a long study of priority 3, all it asked
/// for.
class SchedulerAheadTest : public ::testing::Test {
 protected:
  void SetUp() override {
    bench_.feed(
        StudyAdded{.study = kSweep, .table = table_of(1'000'000), .settled = {}, .priority = 3});
    const SendBatch first = bench_.join(1, 1).at(0);
    sweep_ = {bench_.next_after(first, 1e-3),
              only<SendBatch>(bench_.feed(CreditGiven{1, 1})).at(0)};
  }

  std::vector<SendBatch> add_urgent(std::int32_t priority, std::uint64_t points = 1000) {
    return only<SendBatch>(bench_.feed(StudyAdded{
        .study = kUrgent, .table = table_of(points), .settled = {}, .priority = priority}));
  }

  SchedulerBench bench_;
  std::vector<SendBatch> sweep_;
};

TEST_F(SchedulerAheadTest, ItsFirstBatchGoesOutAtOnceBesidesWhatTheWorkerAskedFor) {
  const auto sent = add_urgent(4);
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].study, kUrgent);
  EXPECT_EQ(sent[0].priority, 4);
  EXPECT_EQ(sweep_[0].priority, 3);
}

TEST_F(SchedulerAheadTest, TheNextOneFollowsWhenThatHasEndedAndNotBefore) {
  const SendBatch first = add_urgent(4).at(0);
  EXPECT_TRUE(only<SendBatch>(bench_.feed(Tick{})).empty());
  const auto next = only<SendBatch>(bench_.solve_and_store(first));
  ASSERT_EQ(next.size(), 1U);
  EXPECT_EQ(next[0].study, kUrgent);
}

TEST_F(SchedulerAheadTest, WhatTheWorkerAsksForMeanwhileIsOfItToo) {
  add_urgent(4);
  bench_.solve_and_store(sweep_[0]);
  const auto sent = only<SendBatch>(bench_.feed(CreditGiven{1, 1}));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].study, kUrgent);
}

TEST_F(SchedulerAheadTest, WhenItIsDoneTheWorkerGetsNoMoreThanItAsksFor) {
  SendBatch batch = add_urgent(4, 2).at(0);
  ASSERT_EQ(batch.count(), 1U);
  batch = only<SendBatch>(bench_.solve_and_store(batch)).at(0);
  EXPECT_TRUE(only<SendBatch>(bench_.solve_and_store(batch)).empty());
  EXPECT_TRUE(only<SendBatch>(bench_.solve_and_store(sweep_[0])).empty());
  EXPECT_EQ(only<SendBatch>(bench_.feed(CreditGiven{1, 1})).size(), 1U);
}

TEST_F(SchedulerAheadTest, OneOfTheSamePriorityWaitsForTheWorkerToAsk) {
  EXPECT_TRUE(add_urgent(3).empty());
  bench_.feed(Tick{});
  EXPECT_TRUE(only<SendBatch>(bench_.feed(HeartbeatReceived{1, {sweep_[0].lease}})).empty());
}

TEST_F(SchedulerAheadTest, APriorityThatIsRaisedCountsFromThenOn) {
  ASSERT_TRUE(add_urgent(3).empty());
  const auto sent = only<SendBatch>(bench_.feed(PriorityChanged{kUrgent, 5}));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].study, kUrgent);
}

TEST_F(SchedulerAheadTest, ANewcomerAndOneThatHoldsNothingGetNothingAhead) {
  bench_.join(2, 1);
  bench_.join(3, 0);
  const auto sent = add_urgent(4);
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].worker, 1U);
}

TEST_F(SchedulerAheadTest, AWorkerThatDoesNotReadGetsNothingAhead) {
  bench_.feed(WorkerBusy{1, true});
  EXPECT_TRUE(add_urgent(4).empty());
}

TEST_F(SchedulerAheadTest, ABatchThatCameAheadIsLostAndReturnedAsAnyOther) {
  const SendBatch ahead = add_urgent(4).at(0);
  const auto again = only<SendBatch>(bench_.feed(BatchesReturned{1, {ahead.lease}}));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].first_point(), ahead.first_point());
  bench_.feed(WorkerLeft{1});
  EXPECT_EQ(bench_.scheduler.study(kUrgent).leased, 0U);
}

}  // namespace
}  // namespace oblique::server
