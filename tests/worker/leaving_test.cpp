// When a worker ends by itself: what it judges from, and what it says.
#include "worker/leaving.h"

#include <vector>

#include "tests/worker/conversation_fixture.h"

namespace oblique::worker {
namespace {

using protocol::WorkerMessage;

TEST(LeavingTest, WithoutALimitEverythingEndsInTime) {
  Leaving leaving({}, 1);
  leaving.note_solved({1, 1}, 1e6);
  leaving.note_batch({1, 1000});
  EXPECT_EQ(leaving.ending_in_time(std::vector<HeldPoints>{{1, 1'000'000}}, 0), 1U);
  EXPECT_TRUE(leaving.has_time_for_more({}, 0));
  EXPECT_FALSE(leaving.is_due(kNever_ms - 1));
  EXPECT_FALSE(leaving.is_idle_for_too_long(kNever_ms - 1));
}

TEST(LeavingTest, WhatItKnowsNothingOfEndsInTime) {
  const Leaving leaving({.until_ms = 5000}, 1);
  EXPECT_EQ(leaving.ending_in_time(std::vector<HeldPoints>{{1, 1'000'000}}, 0), 1U);
  EXPECT_TRUE(leaving.has_time_for_more({}, 0));
}

TEST(LeavingTest, ThreadsShareThePointsOfABatch) {
  constexpr std::int64_t kUntil_ms = 13'000;  // 10 s of work
  Leaving one({.until_ms = kUntil_ms}, 1);
  Leaving four({.until_ms = kUntil_ms}, 4);
  for (Leaving* leaving : {&one, &four}) {
    leaving->note_solved({1, 2}, 2.0);  // 1 s a point and thread
  }
  const std::vector<HeldPoints> held{{1, 8}, {1, 8}};
  EXPECT_EQ(one.ending_in_time(held, 0), 1U);
  EXPECT_EQ(four.ending_in_time(held, 0), 2U);
  EXPECT_EQ(four.ending_in_time(held, 9000), 0U);
  EXPECT_EQ(four.ending_in_time(held, 8000), 1U);
}

TEST(LeavingTest, NonsenseAboutTimeIsPassedOver) {
  Leaving leaving({.until_ms = 5000}, 1);
  leaving.note_solved({1, 0}, 1.0);
  leaving.note_solved({1, 5}, 0.0);
  leaving.note_solved({1, 5}, -1.0);
  EXPECT_EQ(leaving.ending_in_time(std::vector<HeldPoints>{{1, 1000}}, 0), 1U);
  for (std::uint64_t study = 1; study < 1000; ++study) {
    leaving.note_solved({study, 1}, 1000.0);
  }
  EXPECT_EQ(leaving.ending_in_time(std::vector<HeldPoints>{{999, 1}}, 0), 0U);
}

/// A conversation with a limit, 3 s of which are for leaving.
class LeavingConversationTest : public ConversationTest {
 protected:
  void leave_within(std::int64_t until_ms, std::int64_t idle_exit_ms = kNever_ms) {
    ConversationSettings settings;
    settings.leaving = {.until_ms = until_ms == kNever_ms ? kNever_ms : now_ms_ + until_ms,
                        .idle_exit_ms = idle_exit_ms};
    use(settings);
    start();
    auto welcome = welcome_message();
    welcome.mutable_welcome()->set_lost_after_ms(1'000'000);
    receive(welcome);
    receive(study_message(7));
  }

  std::vector<std::uint64_t> given_back() const {
    std::vector<std::uint64_t> leases;
    for (const auto& message : sent(WorkerMessage::kGiveBack)) {
      const auto& ids = message.give_back().lease_ids();
      leases.insert(leases.end(), ids.begin(), ids.end());
    }
    return leases;
  }
};

TEST_F(LeavingConversationTest, AWorkerWhoseTimeIsOverGivesBackWhatIsLeftAndLeaves) {
  leave_within(60'000);
  receive(batch_message(7, 31));
  receive(batch_message(7, 32, 10));
  solve(1, 0, 5, false);
  pass(56'999);
  EXPECT_FALSE(has<DropAll>());
  pass(1);
  EXPECT_TRUE(has<DropAll>());
  EXPECT_EQ(given_back(), (std::vector<std::uint64_t>{31, 32}));
  EXPECT_FALSE(finish());
  receive(stored_message(1));
  take(conversation_->on_solver_idle(now_ms_));
  EXPECT_EQ(sent(WorkerMessage::kGoodbye).size(), 1U);
  ASSERT_TRUE(finish());
  EXPECT_EQ(finish()->exit_code, 0);
}

TEST_F(LeavingConversationTest, AWorkerWhoseTimeIsOverFromTheStartLeavesAtOnce) {
  leave_within(-1000);
  pass(0);
  ASSERT_TRUE(finish());
  EXPECT_EQ(finish()->exit_code, 0);
}

TEST_F(LeavingConversationTest, ABatchThatWouldNotEndInTimeGoesBackAtOnceAndNoneIsAskedFor) {
  leave_within(13'000);  // 10 s of work
  receive(batch_message(7, 31, 0, 10));
  receive(batch_message(7, 32, 10, 8));
  pass(1000);
  solve(1, 0, 1, false);  // 0.5 s each: 4.5 s and 4 s are left
  EXPECT_TRUE(given_back().empty());
  pass(4000);
  solve(1, 1, 7, false);
  EXPECT_TRUE(given_back().empty());
  Progress slow{1, 7, {protocol::failed_point(8, "for the test")}, 20.0, false};
  std::vector<Progress> all;
  all.push_back(std::move(slow));
  take(conversation_->on_progress(std::move(all), now_ms_));
  EXPECT_EQ(given_back(), std::vector<std::uint64_t>{32});
  EXPECT_EQ(effects_of<DropBatch>().size(), 1U);
  EXPECT_EQ(credit_given(), 0U);
  EXPECT_FALSE(finish());
  solve(1, 9, 1, true);
  EXPECT_EQ(credit_given(), 0U);
}

TEST_F(LeavingConversationTest, AWorkerThatCouldEndNoFurtherBatchLeavesBeforeItsTime) {
  leave_within(13'000);
  receive(batch_message(7, 31, 0, 10));
  pass(8000);
  Progress slow{1, 7, {}, 8.0, true};
  for (std::uint64_t i = 0; i < 10; ++i) {
    slow.results.push_back(protocol::failed_point(i, "for the test"));
  }
  std::vector<Progress> all;
  all.push_back(std::move(slow));
  take(conversation_->on_progress(std::move(all), now_ms_));
  EXPECT_EQ(credit_given(), 0U);
  receive(stored_message(1));
  pass(0);
  EXPECT_EQ(sent(WorkerMessage::kGoodbye).size(), 1U);
  ASSERT_TRUE(finish());
  EXPECT_EQ(finish()->exit_code, 0);
}

TEST_F(LeavingConversationTest, AWorkerWithoutWorkLeavesWhenItWasIdleForSoLong) {
  leave_within(kNever_ms, 5000);
  pass(4999);
  EXPECT_FALSE(finish());
  pass(1);
  EXPECT_EQ(sent(WorkerMessage::kGoodbye).size(), 1U);
  ASSERT_TRUE(finish());
  EXPECT_EQ(finish()->exit_code, 0);
}

TEST_F(LeavingConversationTest, ABatchThatTakesLongIsNoIdleness) {
  leave_within(kNever_ms, 5000);
  receive(batch_message(7, 31));
  for (int i = 0; i < 100; ++i) {
    pass(1000);
    EXPECT_FALSE(finish());
  }
  solve(1, 0, 10, true);
  pass(100'000);
  EXPECT_FALSE(finish()) << "its results are not stored";
  receive(stored_message(1));
  pass(4999);
  EXPECT_FALSE(finish());
  pass(1);
  EXPECT_TRUE(finish());
}

TEST_F(LeavingConversationTest, AWorkerThatNoServerAnswersIsIdleToo) {
  ConversationSettings settings;
  settings.leaving.idle_exit_ms = 5000;
  use(settings);
  start();
  for (int i = 0; i < 49; ++i) {
    pass(100);
    ASSERT_FALSE(finish());
  }
  pass(100);
  ASSERT_TRUE(finish());
  EXPECT_EQ(finish()->exit_code, 1);
  EXPECT_EQ(finish()->reason, "leaving: the server was never reached in 5 s");
}

TEST_F(LeavingConversationTest, AWorkerThatWasWelcomedOnceLeavesWithZeroThoughItsServerIsGone) {
  leave_within(kNever_ms, 5000);
  pass(5000);
  ASSERT_TRUE(finish());
  EXPECT_EQ(finish()->exit_code, 0);
  EXPECT_EQ(finish()->reason, "no work for 5 s: leaving (--idle-exit)");
}

TEST_F(LeavingConversationTest, TheNextDeadlineIsNeverLaterThanTheTimeToLeave) {
  leave_within(3100, 50);
  EXPECT_LE(conversation_->next_deadline_ms(), now_ms_ + 50);
  receive(batch_message(7, 31));
  EXPECT_LE(conversation_->next_deadline_ms(), now_ms_ + 100);
}

TEST_F(LeavingConversationTest, AStoppedWorkerGivesBackAtOnceAndDeliversWhatEndsAMomentLater) {
  leave_within(kNever_ms);
  receive(batch_message(7, 31));
  solve(1, 0, 5, false);
  receive(stored_message(1));
  take(conversation_->stop(now_ms_, true));
  EXPECT_EQ(given_back(), std::vector<std::uint64_t>{31});
  EXPECT_FALSE(finish());
  solve(1, 5, 2, false);
  ASSERT_EQ(sent_results().size(), 1U);
  EXPECT_EQ(sent_results()[0].lease_id(), 0U);
  take(conversation_->on_solver_idle(now_ms_));
  EXPECT_FALSE(finish());
  receive(stored_message(2));
  EXPECT_TRUE(finish());
}

TEST_F(LeavingConversationTest, PointsThatTakeLongAreNotWaitedFor) {
  leave_within(kNever_ms);
  receive(batch_message(7, 31));
  take(conversation_->stop(now_ms_, true));
  pass(249);
  EXPECT_FALSE(finish());
  pass(1);
  EXPECT_TRUE(finish());
}

}  // namespace
}  // namespace oblique::worker
