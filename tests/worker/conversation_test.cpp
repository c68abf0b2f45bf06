#include "worker/conversation.h"

#include <algorithm>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "tests/worker/conversation_fixture.h"

namespace oblique::worker {
namespace {

using protocol::WorkerMessage;

TEST_F(ConversationTest, TheFirstMessageIsHelloAndAWelcomedWorkerGivesCreditForTwoBatches) {
  start();
  ASSERT_EQ(effects_.size(), 2U);
  EXPECT_TRUE(std::holds_alternative<Connect>(effects_[0]));
  EXPECT_EQ(std::get<Send>(effects_[1]).message.hello().name(), "test");
  receive(welcome_message());
  EXPECT_EQ(credit_given(), 2U);
}

TEST_F(ConversationTest, ABatchIsSolvedWithTheRecipeOfItsStudy) {
  join();
  receive(batch_message(7, 31, 90, 10));
  const auto solves = effects_of<Solve>();
  ASSERT_EQ(solves.size(), 1U);
  EXPECT_EQ(solves[0].batch.study_id(), 7U);
  EXPECT_EQ(solves[0].batch.point_at(0), 90U);
  EXPECT_EQ(solves[0].batch.size(), 10U);
  EXPECT_EQ(solves[0].batch.points().size(), 100U);
}

TEST_F(ConversationTest, CreditIsGivenAgainForEachBatchSolvedAndNeverForMoreThanTwo) {
  join();
  receive(batch_message(7, 31, 0));
  EXPECT_EQ(credit_given(), 0U);
  receive(batch_message(7, 32, 10));
  EXPECT_EQ(credit_given(), 0U);
  solve(1, 0, 5, false);
  EXPECT_EQ(credit_given(), 0U);
  solve(1, 5, 5, true);
  EXPECT_EQ(credit_given(), 1U);
  solve(2, 10, 10, true);
  EXPECT_EQ(credit_given(), 1U);
}

TEST_F(ConversationTest, AHeartbeatIsSentEachIntervalAndContainsTheHeldLeases) {
  join();
  receive(batch_message(7, 31, 0));
  receive(batch_message(7, 32, 10));
  pass(999);
  EXPECT_TRUE(sent(WorkerMessage::kHeartbeat).empty());
  pass(1);
  const auto beats = sent(WorkerMessage::kHeartbeat);
  ASSERT_EQ(beats.size(), 1U);
  EXPECT_EQ(beats[0].heartbeat().lease_ids_size(), 2);
  EXPECT_EQ(conversation_->next_deadline_ms(), now_ms_ + 1000);
}

TEST_F(ConversationTest, AHeartbeatContainsALeaseUntilItsResultsAreStoredOrTheSessionEnds) {
  const auto leases = [this] {
    pass(1000);
    const auto beats = sent(WorkerMessage::kHeartbeat);
    return beats.size() == 1 ? beats[0].heartbeat().lease_ids_size() : -1;
  };
  join_with_batch();
  solve(1, 0, 10, true);
  EXPECT_EQ(leases(), 1);
  receive(stored_message(1));
  EXPECT_EQ(leases(), 0);
  join_with_batch();
  solve(1, 0, 10, true);
  rejoin();
  EXPECT_EQ(leases(), 0);
}

TEST_F(ConversationTest, AfterSilenceTheWorkerReconnectsAndAnyMessageEndsTheSilence) {
  join();
  for (int i = 0; i < 10; ++i) {
    receive(heartbeat_reply_message());
    pass(2999);
    EXPECT_FALSE(has<Connect>());
  }
  pass(1);
  EXPECT_TRUE(has<Connect>());
  EXPECT_EQ(sent(WorkerMessage::kHello).size(), 1U);
}

TEST_F(ConversationTest, AnUnansweredHelloIsRepeatedAfterAPauseThatDoublesToTwoSeconds) {
  start();
  std::int64_t patience_ms = 3000;  // timeout that doubles up to 12 s, for slow networks
  for (const std::int64_t backoff_ms : {50, 100, 200, 400, 800, 1600, 2000, 2000}) {
    pass(patience_ms - 1);
    EXPECT_EQ(conversation_->next_deadline_ms(), now_ms_ + 1);
    pass(1);
    patience_ms = std::min<std::int64_t>(2 * patience_ms, 12'000);
    EXPECT_FALSE(has<Connect>());
    EXPECT_EQ(has<Note>() && effects_of<Note>()[0].is_warning, backoff_ms == 50)
        << "the warning is logged once";
    EXPECT_EQ(conversation_->next_deadline_ms(), now_ms_ + backoff_ms);
    pass(backoff_ms);
    EXPECT_TRUE(has<Connect>());
    EXPECT_EQ(sent(WorkerMessage::kHello).size(), 1U);
  }
}

TEST_F(ConversationTest, ARepeatedRejectionIsLoggedInFullOnceUntilTheNextWelcome) {
  const auto logged = [this] { return effects_of<Note>().at(0).text; };
  start();
  take(conversation_->on_rejected("not listed", now_ms_));
  EXPECT_EQ(logged(), "not listed: trying again in 2 s");
  pass(2000);
  take(conversation_->on_rejected("not listed", now_ms_));
  EXPECT_EQ(logged(), "still refused, trying again in 4 s");
  pass(4000);
  take(conversation_->on_rejected("no room", now_ms_));
  EXPECT_EQ(logged(), "no room: trying again in 8 s");
  pass(8000);
  receive(welcome_message());
  take(conversation_->on_rejected("no room", now_ms_));
  EXPECT_EQ(logged(), "no room: trying again in 2 s");
}

TEST_F(ConversationTest, AfterAWelcomeTheTimeoutIsThreeSecondsAgain) {
  start();
  pass(3000);
  pass(50);
  receive(welcome_message());
  receive(hello_again_message());
  pass(100);
  ASSERT_TRUE(has<Connect>());
  EXPECT_EQ(conversation_->next_deadline_ms(), now_ms_ + 3000);
}

TEST_F(ConversationTest, AServerThatRepeatedlyRequestsAHelloGetsItAfterPauses) {
  join();
  receive(heartbeat_reply_message());
  receive(hello_again_message());
  EXPECT_TRUE(has<Connect>());
  receive(welcome_message());
  receive(hello_again_message());
  EXPECT_FALSE(has<Connect>());
  EXPECT_EQ(conversation_->next_deadline_ms(), now_ms_ + 50);
}

TEST_F(ConversationTest, MessagesBeforeTheWelcomeAreIgnored) {
  join();
  receive(hello_again_message());
  pass(50);
  receive(batch_message(7, 31));
  EXPECT_TRUE(effects_.empty());
  receive(stored_message(1));
  EXPECT_TRUE(effects_.empty());
}

TEST_F(ConversationTest, AfterAFailedSendTheWorkerReconnects) {
  join();
  receive(heartbeat_reply_message());
  take(conversation_->on_send_failed(now_ms_));
  EXPECT_TRUE(has<Connect>());
}

TEST_F(ConversationTest, ARefusedWorkerExitsWithOneAndTheReason) {
  start();
  protocol::ServerToWorker message;
  message.mutable_refused()->set_reason("protocol 2 is spoken here");
  receive(message);
  EXPECT_EQ(exit_code(), 1);
  EXPECT_NE(finish()->reason.find("protocol 2 is spoken here"), std::string::npos);
}

TEST_F(ConversationTest, ABatchOfAnUnknownStudyOrUnknownPointsMakesTheWorkerReconnect) {
  constexpr auto kMax = std::numeric_limits<std::int64_t>::max();
  struct Case {
    std::uint64_t study_id;
    std::vector<std::int64_t> ranges;
  };
  const Case cases[] = {{8, {0, 10}},
                        {7, {95, 6}},
                        {7, {100, 1}},
                        {7, {0, 0}},
                        {7, {50, -1}},
                        {7, {kMax, 2}},
                        {7, {-1, 2}},
                        {7, {20, 10, 0}},
                        {7, {20, 10, -31, 2}},
                        {7, {20, 10, 0, 0}},
                        {7, {20, 10, 60, 11}},
                        {7, {20, 10, kMax, 2}},
                        {7, {20, 10, -30, 90, 0, 10}},
                        {7, {20, 10, 0, 5, 0}}};
  for (const Case& c : cases) {
    use({});
    join();
    receive(heartbeat_reply_message());
    auto message = batch_message(c.study_id, 31);
    message.mutable_batch()->mutable_ranges()->Assign(c.ranges.begin(), c.ranges.end());
    receive(message);
    EXPECT_FALSE(has<Solve>());
    EXPECT_TRUE(has<Connect>());
  }
}

TEST_F(ConversationTest, ABatchMayBeSeveralRangesInAnyOrder) {
  join();
  auto message = batch_message(7, 31, 20, 10);
  for (const std::int64_t number : {-25, 2, 90, 3}) {  // two ranges: points 5 to 6 and 97 to 99
    message.mutable_batch()->add_ranges(number);
  }
  receive(message);
  const auto solve = effects_of<Solve>();
  ASSERT_EQ(solve.size(), 1U);
  const Batch& batch = solve[0].batch;
  EXPECT_EQ(batch.size(), 15U);
  EXPECT_EQ(batch.point_at(9), 29U);
  EXPECT_EQ(batch.point_at(10), 5U);
  EXPECT_EQ(batch.point_at(12), 97U);
  EXPECT_EQ(batch.point_at(14), 99U);
}

TEST_F(ConversationTest, AnUnreadableStudyEndsTheWorkerInsteadOfFailingItsPoints) {
  start();
  receive(welcome_message());
  protocol::ServerToWorker message = study_message(7);
  message.mutable_study()->mutable_recipe()->mutable_blocks(0)->mutable_axes(0)->set_key("wobble");
  receive(message);
  EXPECT_EQ(exit_code(), 1);
  EXPECT_NE(finish()->reason.find("wobble"), std::string::npos);
}

TEST_F(ConversationTest, ANoticeIsLoggedAndAMessageOfUnknownKindIsIgnored) {
  join();
  receive(protocol::ServerToWorker());
  EXPECT_TRUE(effects_.empty());
  protocol::ServerToWorker message;
  message.mutable_notice()->set_text("mind the step");
  receive(message);
  EXPECT_TRUE(has<Note>());
}

TEST_F(ConversationTest, AWithdrawnStudyIsDroppedAndItsCreditGivenAgain) {
  join();
  receive(batch_message(7, 31, 0));
  receive(batch_message(7, 32, 10));
  solve(1, 0, 5, false);
  receive(withdraw_message(7));
  ASSERT_EQ(effects_of<DropStudy>().size(), 1U);
  EXPECT_EQ(effects_of<DropStudy>()[0].study_id, 7U);
  EXPECT_EQ(credit_given(), 2U);
  EXPECT_EQ(conversation_->unacknowledged_results(), 0U);
}

TEST_F(ConversationTest, AReleasedBatchIsDroppedAndItsCreditGivenAgain) {
  join_with_batch();
  receive(batch_message(7, 32));
  protocol::ServerToWorker release;
  release.mutable_release()->set_lease_id(31);
  receive(release);
  ASSERT_TRUE(has<DropBatch>());
  EXPECT_TRUE(has<Send>()) << "credit for another batch";
  release.mutable_release()->set_lease_id(99);
  receive(release);
  EXPECT_FALSE(has<DropBatch>()) << "an unknown lease";
}

TEST_F(ConversationTest, AStoppingServerGetsResultsButNoCreditUntilTheNextWelcome) {
  join_with_batch();
  protocol::ServerToWorker stopping;
  stopping.mutable_stopping();
  receive(stopping);
  EXPECT_FALSE(has<Finish>());
  solve(1, 0, 10, true);
  EXPECT_EQ(sent_results().size(), 1U);
  EXPECT_EQ(credit_given(), 0U);
  receive(hello_again_message());
  pass(2000);
  receive(welcome_message());
  EXPECT_EQ(credit_given(), 2U);
}

TEST_F(ConversationTest, AnIdleWorkerThatIsStoppedLeavesAtOnceWithGoodbyeIfItWasWelcomed) {
  for (const bool is_welcomed : {false, true}) {
    use({});
    is_welcomed ? join() : start();
    stop();
    EXPECT_EQ(sent(WorkerMessage::kGoodbye).size(), is_welcomed ? 1U : 0U);
    EXPECT_EQ(exit_code(), 0);
  }
}

TEST_F(ConversationTest, AStoppedWorkerIgnoresBatchesAndSaysGoodbyeAfterItsResultsAreStored) {
  join_with_batch();
  solve(1, 0, 5, false);
  stop();
  EXPECT_TRUE(has<DropAll>());
  EXPECT_FALSE(finish());
  receive(batch_message(7, 32));
  EXPECT_FALSE(has<Solve>());
  receive(stored_message(1));
  EXPECT_EQ(sent(WorkerMessage::kGoodbye).size(), 1U);
  EXPECT_TRUE(finish());
}

TEST_F(ConversationTest, AStoppedWorkerWaitsTwoSecondsForAcknowledgementsAndThenLeaves) {
  join_with_batch();
  solve(1, 0, 5, false);
  stop();
  pass(1999);
  EXPECT_FALSE(finish());
  pass(1);
  EXPECT_EQ(exit_code(), 0);
  EXPECT_NE(finish()->reason.find("5 results"), std::string::npos);
}

TEST_F(ConversationTest, ASecondStopEndsTheWorkerAtOnceUnlessItFollowsWithinASecond) {
  for (const std::int64_t later_ms : {999, 1000}) {
    join_with_batch();
    solve(1, 0, 5, false);
    stop();
    pass(later_ms);
    stop();
    EXPECT_EQ(finish().has_value(), later_ms == 1000);
  }
}

// ---- --until and --idle-exit --------------------------------------------------------------------

/// Starts workers with a time limit or an idle limit. They leave 3 s before the time limit.
class ExitTest : public ConversationTest {
 protected:
  void leave_within(std::int64_t duration_ms, std::int64_t idle_exit_ms = kNever_ms) {
    ConversationSettings settings;
    settings.exit = {.stop_ms = now_ms_ + duration_ms, .idle_exit_ms = idle_exit_ms};
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

TEST_F(ExitTest, AtItsTimeLimitAWorkerGivesBackItsPointsAndLeaves) {
  leave_within(57'000);
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
  EXPECT_EQ(sent(WorkerMessage::kGoodbye).size(), 1U);
  EXPECT_EQ(exit_code(), 0);
}

TEST_F(ExitTest, AWorkerStartedAfterItsTimeLimitLeavesAtOnce) {
  leave_within(-1000);
  pass(0);
  EXPECT_EQ(exit_code(), 0);
}

TEST_F(ExitTest, AWorkerWithALongBatchIsNotIdle) {
  leave_within(kNever_ms, 5000);
  receive(batch_message(7, 31));
  for (int i = 0; i < 100; ++i) {
    pass(1000);
    EXPECT_FALSE(finish());
  }
  solve(1, 0, 10, true);
  pass(100'000);
  EXPECT_FALSE(finish()) << "its results are not acknowledged";
  receive(stored_message(1));
  pass(4999);
  EXPECT_FALSE(finish());
  pass(1);
  EXPECT_TRUE(finish());
}

TEST_F(ExitTest, AWorkerWithoutServerIsIdleToo) {
  use({.exit = {.idle_exit_ms = 5000}});
  start();
  for (int i = 0; i < 49; ++i) {
    pass(100);
    ASSERT_FALSE(finish());
  }
  pass(100);
  EXPECT_EQ(exit_code(), 1);
  EXPECT_EQ(finish()->reason, "leaving: the server was never reached in 5 s");
}

TEST_F(ExitTest, AWorkerThatWasWelcomedExitsWithZeroEvenIfItsServerIsGone) {
  leave_within(kNever_ms, 5000);
  pass(5000);
  EXPECT_EQ(exit_code(), 0);
  EXPECT_EQ(finish()->reason, "no work for 5 s: leaving (--idle-exit)");
}

TEST_F(ExitTest, TheNextDeadlineIsNeverLaterThanTheTimeLimit) {
  leave_within(100, 50);
  EXPECT_LE(conversation_->next_deadline_ms(), now_ms_ + 50);
  receive(batch_message(7, 31));
  EXPECT_LE(conversation_->next_deadline_ms(), now_ms_ + 100);
}

TEST_F(ExitTest, AStoppedWorkerGivesBackAtOnceAndWaitsForItsResultsToBeStored) {
  leave_within(kNever_ms);
  receive(batch_message(7, 31));
  solve(1, 0, 5, false);
  take(conversation_->stop(now_ms_));
  EXPECT_EQ(given_back(), std::vector<std::uint64_t>{31});
  EXPECT_FALSE(finish());
  receive(stored_message(1));
  EXPECT_TRUE(finish());
}

}  // namespace
}  // namespace oblique::worker
