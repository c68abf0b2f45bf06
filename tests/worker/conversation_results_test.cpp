#include <limits>

#include "proto/result_message.h"
#include "tests/worker/conversation_fixture.h"
#include "worker/conversation.h"

namespace oblique::worker {
namespace {

using protocol::WorkerMessage;

protocol::ServerToWorker trace_order(std::uint64_t id) {
  protocol::ServerToWorker message;
  message.mutable_trace_order()->set_trace_id(id);
  return message;
}

protocol::Trace trace_of(std::uint64_t id) {
  protocol::Trace trace;
  trace.set_trace_id(id);
  return trace;
}

TEST_F(ConversationTest, ResultsMessagesAreNumberedFromOneAndTheLastOneEndsTheBatch) {
  join_with_batch();
  solve(1, 0, 4, false);
  ASSERT_EQ(sent_results().size(), 1U);
  protocol::Results results = sent_results()[0];
  EXPECT_EQ(results.sequence(), 1U);
  EXPECT_EQ(results.study_id(), 7U);
  EXPECT_EQ(results.lease_id(), 31U);
  EXPECT_EQ(results.attempt(), 1U);
  EXPECT_FALSE(results.batch_done());
  EXPECT_EQ(results.results_size(), 4);
  solve(1, 4, 6, true);
  ASSERT_EQ(sent_results().size(), 1U);
  results = sent_results()[0];
  EXPECT_EQ(results.sequence(), 2U);
  EXPECT_TRUE(results.batch_done());
  EXPECT_EQ(results.results(5).point(), 9U);
}

TEST_F(ConversationTest, ResultsOfABatchOfAnEarlierSessionKeepItsAttempt) {
  join();
  protocol::ServerToWorker batch = batch_message(7, 31);
  batch.mutable_batch()->set_attempt(5);
  receive(batch);
  EXPECT_EQ(effects_of<Solve>().at(0).batch.attempt(), 5U);
  rejoin();
  std::vector<Progress> progress(1);
  progress[0] = {
      .batch = 1, .study_id = 7, .results = {protocol::failed_point(3, "x")}, .attempt = 5};
  take(conversation_->on_progress(std::move(progress), now_ms_));
  EXPECT_EQ(sent_results().at(0).attempt(), 5U);
  EXPECT_EQ(sent_results().at(0).lease_id(), 0U);
}

TEST_F(ConversationTest, TheEndOfABatchIsReportedEvenWithoutNewResults) {
  join_with_batch();
  solve(1, 0, 10, false);
  solve(1, 10, 0, true);
  ASSERT_EQ(sent_results().size(), 1U);
  EXPECT_TRUE(sent_results()[0].batch_done());
  EXPECT_EQ(sent_results()[0].results_size(), 0);
}

TEST_F(ConversationTest, ManyResultsAreSplitAndOnlyTheLastMessageEndsTheBatch) {
  join_with_batch({.results_a_message = 4});
  solve(1, 0, 10, true);
  const auto results = sent_results();
  ASSERT_EQ(results.size(), 3U);
  double busy_s = 0.0;
  std::uint64_t next = 0;
  for (std::size_t i = 0; i < results.size(); ++i) {
    EXPECT_EQ(results[i].batch_done(), i == 2);
    EXPECT_EQ(results[i].sequence(), i + 1);
    busy_s += results[i].busy_s();
    for (const auto& result : results[i].results()) {
      EXPECT_EQ(result.point(), next++);
    }
  }
  EXPECT_EQ(next, 10U);
  EXPECT_NEAR(busy_s, 0.5, 1e-12);
}

TEST_F(ConversationTest, AMessageStaysBelowItsLimitInBytesAndALargeResultIsSentAlone) {
  join_with_batch({.bytes_a_message = 100});
  solve(1, 0, 10, true);
  EXPECT_GT(sent_results().size(), 1U);
  for (const auto& results : sent_results()) {
    EXPECT_LT(results.ByteSizeLong(), 200U);
  }
  join_with_batch({.bytes_a_message = 10});
  solve(1, 0, 10, true);
  ASSERT_EQ(sent_results().size(), 10U);
  EXPECT_EQ(sent_results()[0].results(0).error(), "for the test") << "in the order of solving";
}

TEST_F(ConversationTest, AResultTooLargeToSendBecomesAFailedPoint) {
  use({.most_bytes_a_result = 100});
  join();
  receive(batch_message(7, 31, 0, 1));
  take(conversation_->on_progress(
      {{1, 7, {protocol::failed_point(0, std::string(1000, 'x'))}, 0.1, true}}, now_ms_));
  ASSERT_EQ(sent_results().size(), 1U);
  EXPECT_EQ(sent_results()[0].results(0).error(), "its result is too large to send");
}

TEST_F(ConversationTest, PointsThatAFilterLeavesOutAreReportedAsRangesOfTheirBatch) {
  join();
  receive(batch_message(7, 31, 0, 10));
  take(conversation_->on_progress(
      {{1, 7, {protocol::failed_point(3, "for the test")}, 0.1, true, {{0, 3}, {4, 10}}}},
      now_ms_));
  ASSERT_EQ(sent_results().size(), 1U);
  const protocol::Results results = sent_results()[0];
  EXPECT_EQ(results.lease_id(), 31U);
  EXPECT_TRUE(results.batch_done());
  EXPECT_EQ(std::vector<std::uint64_t>(results.left_out().begin(), results.left_out().end()),
            (std::vector<std::uint64_t>{0, 3, 4, 6}));
}

TEST_F(ConversationTest, ManyRangesAreSplitAndOnlyTheLastMessageEndsTheBatch) {
  join();
  receive(study_message(7, 100'000));
  receive(batch_message(7, 31, 0, 100'000));
  std::vector<Batch::Range> ranges;
  for (std::uint64_t point = 0; point < 100'000; point += 4) {
    ranges.push_back({point, point + 1});
  }
  take(conversation_->on_progress({{1, 7, {}, 0.1, true, ranges}}, now_ms_));
  int numbers = 0;
  ASSERT_GT(sent_results().size(), 1U);
  for (const protocol::Results& results : sent_results()) {
    EXPECT_LE(results.left_out_size(), 2 * protocol::kMaxLeftOutRanges);
    numbers += results.left_out_size();
  }
  EXPECT_EQ(numbers, 50'000);
  EXPECT_FALSE(sent_results().front().batch_done());
  EXPECT_TRUE(sent_results().back().batch_done());
}

TEST_F(ConversationTest, UnacknowledgedResultsAreSentAgainBeforeCreditIsGiven) {
  join_with_batch();
  solve(1, 0, 4, false);
  solve(1, 4, 3, false);
  receive(stored_message(1));
  rejoin();
  const auto sends = effects_of<Send>();
  ASSERT_EQ(sends.size(), 2U);
  EXPECT_EQ(sends[0].message.results().sequence(), 2U);
  EXPECT_EQ(sends[0].message.results().results(0).point(), 4U);
  EXPECT_EQ(sends[1].message.credit().batches(), 2U);
}

TEST_F(ConversationTest, ResultsOfAnEarlierSessionBelongToNoLease) {
  join_with_batch();
  solve(1, 0, 10, true);
  rejoin();
  ASSERT_EQ(sent_results().size(), 1U);
  EXPECT_EQ(sent_results()[0].lease_id(), 0U);
  EXPECT_FALSE(sent_results()[0].batch_done());
}

TEST_F(ConversationTest, ResultsHaveTheUidOfTheStudyForWhichTheyWereSolved) {
  join_with_batch();
  rejoin();
  auto other_study = study_message(7);
  other_study.mutable_study()->set_uid("another study of that number");
  receive(other_study);
  receive(batch_message(7, 32));
  ASSERT_TRUE(has<Solve>());
  EXPECT_EQ(effects_of<Solve>()[0].batch.study_uid(), "another study of that number");
  solve(1, 0, 3, false);
  ASSERT_EQ(sent_results().size(), 1U);
  EXPECT_EQ(sent_results()[0].study_uid(), "uid 7");
}

TEST_F(ConversationTest, BatchesOfAnEarlierSessionAreDroppedAtTheWelcome) {
  join_with_batch();
  receive(hello_again_message());
  EXPECT_FALSE(has<DropAll>());
  receive(welcome_message());
  EXPECT_TRUE(has<DropAll>());
  EXPECT_EQ(credit_given(), 2U);
}

TEST_F(ConversationTest, SolvedPointsOfADroppedBatchAreSentWithoutALease) {
  join_with_batch();
  rejoin();
  receive(study_message(7));
  receive(batch_message(7, 31));  // a restarted server uses lease number 31 again
  solve(1, 0, 3, false);
  ASSERT_EQ(sent_results().size(), 1U);
  EXPECT_EQ(sent_results()[0].lease_id(), 0U);
  solve(1, 3, 0, true);
  EXPECT_TRUE(sent_results().empty());
  solve(2, 0, 10, true);
  ASSERT_EQ(sent_results().size(), 1U);
  EXPECT_EQ(sent_results()[0].lease_id(), 31U);
  EXPECT_TRUE(sent_results()[0].batch_done());
}

TEST_F(ConversationTest, PointsSolvedWithoutAServerAreKeptAndSentAfterTheWelcome) {
  join_with_batch();
  receive(hello_again_message());
  solve(1, 0, 10, true);
  EXPECT_TRUE(sent_results().empty());
  EXPECT_EQ(conversation_->unacknowledged_results(), 10U);
  receive(welcome_message());
  ASSERT_EQ(sent_results().size(), 1U);
  EXPECT_EQ(sent_results()[0].results_size(), 10);
}

TEST_F(ConversationTest, ResultsForOneDatabaseAreNeverSentToAnother) {
  join_with_batch();
  solve(1, 0, 10, true);
  rejoin("another");
  EXPECT_TRUE(sent_results().empty());
  EXPECT_EQ(conversation_->unacknowledged_results(), 0U);
}

TEST_F(ConversationTest, APointSolvedAfterAChangeOfTheDatabaseIsNotSent) {
  join_with_batch();
  rejoin("another");
  receive(study_message(7));
  receive(batch_message(7, 31));
  solve(1, 0, 10, false);
  EXPECT_TRUE(sent_results().empty()) << "study 7 is another study now";
  solve(2, 0, 10, false);
  EXPECT_EQ(sent_results().size(), 1U);
}

TEST_F(ConversationTest,
       TooManyUnacknowledgedResultsOrBytesStopCreditAndSolvingUntilTheyAreStored) {
  for (const OutboxLimits limits :
       {OutboxLimits{.unacknowledged_results = 10}, OutboxLimits{.unacknowledged_bytes = 150}}) {
    join_with_batch({.outbox = limits});
    solve(1, 0, 1, false);
    EXPECT_TRUE(conversation_->may_solve());
    solve(1, 1, 9, true);
    EXPECT_FALSE(conversation_->may_solve());
    EXPECT_EQ(credit_given(), 0U);
    receive(stored_message(2));
    EXPECT_TRUE(conversation_->may_solve());
    EXPECT_EQ(credit_given(), 1U);
  }
}

TEST_F(ConversationTest, KeptResultsAreSentAFewMessagesAtATime) {
  join_with_batch({.outbox = {.messages_on_their_way = 2}});
  receive(hello_again_message());
  for (std::uint64_t point = 0; point < 5; ++point) {
    solve(1, point, 1, false);
  }
  receive(welcome_message());
  EXPECT_EQ(sent_results().size(), 2U);
  EXPECT_EQ(credit_given(), 0U) << "with credit the server would lease the same points again";
  receive(stored_message(1));
  ASSERT_EQ(sent_results().size(), 1U);
  EXPECT_EQ(sent_results()[0].sequence(), 3U);
  receive(stored_message(3));
  receive(stored_message(2));
  EXPECT_EQ(sent_results().back().sequence(), 5U);
  EXPECT_EQ(credit_given(), 2U);
  receive(stored_message(4));
  receive(stored_message(5));
  EXPECT_EQ(conversation_->unacknowledged_results(), 0U);
}

TEST_F(ConversationTest, AWithdrawnStudyMakesRoomForTheResultsOfOthers) {
  use({.outbox = {.messages_on_their_way = 1}});
  join();
  receive(study_message(8));
  receive(batch_message(7, 31));
  receive(batch_message(8, 32));
  solve(1, 0, 1, false);
  solve(1, 1, 1, false);
  solve(2, 0, 1, false, 8);
  receive(withdraw_message(7));
  ASSERT_EQ(sent_results().size(), 1U);
  EXPECT_EQ(sent_results()[0].study_id(), 8U);
}

TEST_F(ConversationTest, ARepeatedOrUnknownAcknowledgementHasNoEffect) {
  join_with_batch();
  solve(1, 0, 4, false);
  solve(1, 4, 4, false);
  receive(stored_message(2));
  receive(stored_message(2));
  receive(stored_message(77));
  receive(stored_message(std::numeric_limits<std::uint64_t>::max()));
  EXPECT_EQ(conversation_->unacknowledged_results(), 4U);
  receive(stored_message(1));
  EXPECT_EQ(conversation_->unacknowledged_results(), 0U);
}

TEST_F(ConversationTest, AnOrderedTraceIsSolvedAndDoesNotChangeTheCredit) {
  join();
  receive(trace_order(5));
  ASSERT_EQ(effects_of<SolveTrace>().size(), 1U);
  EXPECT_EQ(effects_of<SolveTrace>()[0].order.trace_id(), 5U);
  take(conversation_->on_traces({trace_of(5)}, now_ms_));
  EXPECT_EQ(sent(WorkerMessage::kTrace).size(), 1U);
  EXPECT_EQ(credit_given(), 0U);
  protocol::ServerToWorker cancel;
  cancel.mutable_trace_cancel()->set_trace_id(5);
  receive(cancel);
  ASSERT_EQ(effects_of<CancelTrace>().size(), 1U);
}

TEST_F(ConversationTest, TracesOfAnEarlierSessionAreForgotten) {
  join();
  receive(trace_order(5));
  receive(hello_again_message());
  take(conversation_->on_traces({trace_of(5)}, now_ms_));
  EXPECT_TRUE(sent(WorkerMessage::kTrace).empty()) << "no server is connected";
  pass(1000);  // it reconnects
  receive(welcome_message());
  EXPECT_TRUE(has<DropAll>());
}

TEST_F(ConversationTest, AStoppingWorkerDeclinesTraces) {
  join_with_batch();
  solve(1, 0, 1, false);  // the worker waits until this result is stored
  stop();
  EXPECT_TRUE(has<DropAll>());
  receive(trace_order(5));
  EXPECT_FALSE(has<SolveTrace>());
  ASSERT_EQ(sent(WorkerMessage::kTrace).size(), 1U);
  EXPECT_TRUE(sent(WorkerMessage::kTrace)[0].trace().declined());
}

}  // namespace
}  // namespace oblique::worker
