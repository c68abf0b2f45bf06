// Traces in the conversation with the server.
#include "tests/worker/conversation_fixture.h"

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

TEST_F(ConversationTest, AnOrderedTraceIsSolvedAndTakesNothingFromTheCredit) {
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
  EXPECT_TRUE(sent(WorkerMessage::kTrace).empty()) << "nobody is there to take it";
  pass(1000);  // it connects again
  receive(welcome_message());
  EXPECT_TRUE(has<DropTraces>());
}

TEST_F(ConversationTest, AStoppingWorkerTakesNoTrace) {
  join();
  receive(batch_message(7, 31));
  solve(1, 0, 1, false);  // it waits for this to be stored
  take(conversation_->stop(now_ms_));
  EXPECT_TRUE(has<DropTraces>());
  receive(trace_order(5));
  EXPECT_FALSE(has<SolveTrace>());
  ASSERT_EQ(sent(WorkerMessage::kTrace).size(), 1U);
  EXPECT_TRUE(sent(WorkerMessage::kTrace)[0].trace().not_taken());
}

}  // namespace
}  // namespace oblique::worker
