// Traces as the service sees them: who requests them, who solves them, who has gone.
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "server/study/limits.h"
#include "tests/server/service/service_fixture.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

class ServiceTraceTest : public ServiceTest {
 protected:
  ServiceTraceTest() {
    request(submit_request("a", 100));
    write_all();
    ports_.replies.clear();
  }

  static ClientRequest trace_request(std::uint64_t id, std::uint64_t point,
                                     const std::string& study = "a") {
    ClientRequest message;
    message.set_request_id(id);
    message.mutable_trace()->set_study(study);
    message.mutable_trace()->set_point(point);
    message.mutable_trace()->set_every(1);
    return message;
  }
  void ask(ClientRequest message, const std::string& identity = "client",
           const std::shared_ptr<const KeyIdentity>& holder = nullptr) {
    message.set_protocol_version(protocol::kProtocolVersion);
    service_->client_frame(identity, protocol::encode(message), now_, holder);
  }
  void ask(std::uint64_t id, std::uint64_t point, const std::string& identity = "client") {
    ask(trace_request(id, point), identity);
  }
  void end(std::uint64_t id, const std::string& identity = "client") {
    ClientRequest message;
    message.mutable_end_query()->set_request_id(id);
    ask(message, identity);
  }
  std::string refusal() { return last_reply().error().message(); }

  /// Orders that workers were sent.
  std::vector<protocol::TraceOrder> orders() const {
    std::vector<protocol::TraceOrder> found;
    for (const ServerToWorker& message : ports_.worker_messages) {
      if (message.has_trace_order()) {
        found.push_back(message.trace_order());
      }
    }
    return found;
  }
  std::size_t cancels() const {
    return static_cast<std::size_t>(
        std::count_if(ports_.worker_messages.begin(), ports_.worker_messages.end(),
                      [](const ServerToWorker& message) { return message.has_trace_cancel(); }));
  }

  static protocol::Trace trace_of(const protocol::TraceOrder& order, const std::string& states) {
    const auto shape = solver::trace_shape(
        static_cast<std::size_t>(order.model().lengths_m_size()),
        static_cast<std::size_t>(order.model().elements_per_link()), order.shape());
    protocol::Trace trace;
    trace.set_trace_id(order.trace_id());
    for (std::size_t i = 0; i < states.size() * solver::trace_numbers(shape); ++i) {
      trace.add_values(static_cast<double>(i));
    }
    trace.set_states(states);
    *trace.mutable_result() = solved_point(0);
    return trace;
  }
  static protocol::Trace not_taken(const protocol::TraceOrder& order) {
    protocol::Trace trace;
    trace.set_trace_id(order.trace_id());
    trace.set_not_taken(true);
    return trace;
  }
  void worker_sends(const protocol::Trace& trace, const std::string& identity = "worker") {
    WorkerMessage message;
    *message.mutable_trace() = trace;
    worker_says(message, identity);
  }
  void goodbye(const std::string& identity) {
    WorkerMessage message;
    message.mutable_goodbye();
    worker_says(message, identity);
  }
  void pass(std::int64_t duration_ms) {
    for (const std::int64_t end_ms = now_.steady_ms + duration_ms; now_.steady_ms < end_ms;) {
      now_.steady_ms += 100;
      WorkerMessage beat;
      beat.mutable_heartbeat();
      service_->worker_frame("worker", protocol::encode(beat), now_);
      service_->tick(now_);
    }
  }
};

TEST_F(ServiceTraceTest, APointGoesToAWorkerBesideItsBatchesAndTheAnswerToTheClient) {
  hello();
  credit(2);
  auto request = trace_request(7, 3);
  request.mutable_trace()->set_fall(true);
  request.mutable_trace()->set_every(5);
  ask(request);
  ASSERT_EQ(orders().size(), 1U);
  const auto order = orders()[0];
  EXPECT_EQ(order.h_m(), 1.0);
  EXPECT_DOUBLE_EQ(order.mu(), 3.0 / 99.0);
  EXPECT_TRUE(order.fall());
  EXPECT_EQ(order.every(), 5U);
  worker_sends(trace_of(order, "\4\2\3"));
  ASSERT_EQ(ports_.replies.size(), 1U);
  EXPECT_EQ(last_reply().request_id(), 7U);
  const auto reply = last_reply().trace();
  EXPECT_EQ(reply.trace().SerializeAsString(), trace_of(order, "\4\2\3").SerializeAsString());
  EXPECT_EQ(reply.mu(), order.mu());
  EXPECT_EQ(reply.solver_version(), "1.0");
  EXPECT_EQ(reply.outputs(), protocol::sent_outputs());
}

TEST_F(ServiceTraceTest, WhatThePointIsIsSaidWithoutAnyWorker) {
  auto message = trace_request(7, 99);
  message.mutable_trace()->set_only_point(true);
  ask(message);
  EXPECT_EQ(last_reply().trace().mu(), 1.0);
  EXPECT_EQ(last_reply().trace().model().lengths_m_size(), 3);
  EXPECT_FALSE(last_reply().trace().has_trace());
}

TEST_F(ServiceTraceTest, WhatDoesNotExistIsNamed) {
  hello();
  ask(trace_request(7, 0, "b"));
  EXPECT_THAT(refusal(), HasSubstr("no study called \"b\""));
  ask(trace_request(7, 0, std::string(100'000, 'x')));
  EXPECT_LT(refusal().size(), 1000U);
  for (const std::uint64_t point : {std::uint64_t{100}, UINT64_MAX}) {
    ask(7, point);
    EXPECT_THAT(refusal(), HasSubstr("its points are 0 to 99"));
  }
  EXPECT_TRUE(orders().empty());
}

TEST_F(ServiceTraceTest, AFailedPointIsNotSolvedAgainForItMayKill) {
  hello_and_credit();
  answer_batch(0);
  ask(7, 0);
  EXPECT_THAT(refusal(), HasSubstr("point 0 of the study \"a\" failed"));
  EXPECT_TRUE(orders().empty());
}

TEST_F(ServiceTraceTest, APointWithoutAnAnswerIsSolvedEachTimeItIsRequested) {
  hello();
  ask(7, 3);
  auto trace = trace_of(orders()[0], "\2");
  *trace.mutable_result() = protocol::failed_point(0, "it slides for ever");
  worker_sends(trace);
  EXPECT_EQ(last_reply().trace().trace().result().error(), "it slides for ever");
  EXPECT_EQ(last_reply().trace().trace().states().size(), 0U);
  auto with_shape = trace_request(8, 3);
  with_shape.mutable_trace()->set_shape(true);
  ask(with_shape);
  EXPECT_TRUE(orders().at(1).shape());
}

TEST_F(ServiceTraceTest, ATraceThatIsTooLongIsAnsweredWithWhatWouldFit) {
  hello();
  ask(7, 3);
  auto trace = trace_of(orders()[0], "");
  trace.set_instants(1'000'000);
  trace.set_every(12);
  worker_sends(trace);
  EXPECT_EQ(last_reply().trace().trace().instants(), 1'000'000U);
  EXPECT_EQ(last_reply().trace().trace().every(), 12U);
}

TEST_F(ServiceTraceTest, WithoutAWorkerItIsRefusedAtOnce) {
  ask(7, 3);
  EXPECT_THAT(refusal(), HasSubstr("no worker is connected"));
}

TEST_F(ServiceTraceTest, AWorkerThatIsLostIsReplacedOnce) {
  hello("one");
  ask(7, 3);
  hello("two");
  goodbye("one");
  ASSERT_EQ(orders().size(), 2U);
  EXPECT_TRUE(ports_.replies.empty());
  hello("three");
  goodbye("two");
  EXPECT_THAT(refusal(), HasSubstr("two workers were lost"));
  EXPECT_EQ(orders().size(), 2U);
}

TEST_F(ServiceTraceTest, AWorkerThatIsSilentIsLostToo) {
  hello("silent");
  ask(7, 3);
  hello("worker");
  pass(5000);
  EXPECT_EQ(orders().size(), 2U);
}

TEST_F(ServiceTraceTest, AWorkerThatDoesNotTakeItLeavesItToAnother) {
  hello("one");
  ask(7, 3);
  hello("two");
  worker_sends(not_taken(orders()[0]), "one");
  ASSERT_EQ(orders().size(), 2U);
  worker_sends(not_taken(orders()[1]), "two");
  EXPECT_THAT(refusal(), HasSubstr("no worker"));
}

TEST_F(ServiceTraceTest, IsCancelledWhenItsClientHasGoneOrEndsItsRequest) {
  hello();
  ask(7, 3);
  ask(7, 3);  // sent again
  end(8);
  end(7, "another");
  EXPECT_EQ(cancels(), 0U);
  end(7);
  EXPECT_EQ(cancels(), 1U);
  ask(8, 4);
  EXPECT_EQ(orders().size(), 1U) << "the worker has not said that it is free";
  worker_sends(not_taken(orders()[0]));
  EXPECT_EQ(orders().size(), 2U);
  service_->client_left("client");
  EXPECT_EQ(cancels(), 2U);
  EXPECT_TRUE(ports_.replies.empty());
}

TEST_F(ServiceTraceTest, AClientHearsEverySecondThatItsTraceWaitsOrIsSolved) {
  hello();
  ask(7, 3);
  ask(7, 4, "another");
  pass(1000);
  ASSERT_EQ(ports_.replies.size(), 2U);
  EXPECT_TRUE(ports_.replies[0].still_working().runs());
  EXPECT_FALSE(ports_.replies[1].still_working().runs());
  ports_.unreachable = "client";
  pass(1000);
  EXPECT_EQ(cancels(), 1U) << "no word of it could be delivered";
}

TEST_F(ServiceTraceTest, ATraceHasItsTime) {
  hello();
  auto message = trace_request(7, 3);
  message.mutable_trace()->set_time_limit_ms(500);
  ask(message);
  pass(500);
  EXPECT_THAT(refusal(), HasSubstr("took too long"));
  EXPECT_EQ(cancels(), 1U);
}

TEST_F(ServiceTraceTest, FewAreWithWorkersAtATimeAndFewWait) {
  for (const char* worker : {"one", "two", "three"}) {
    hello(worker);
  }
  for (std::uint64_t i = 0; i < 100; ++i) {
    ask(i, i);
  }
  EXPECT_EQ(ports_.replies.size(), 100 - limits::kWaitingTracesOfConnection);
  EXPECT_THAT(refusal(), HasSubstr("too many traces"));
  ports_.replies.clear();
  for (std::uint64_t i = 0; i < 100; ++i) {
    ask(1, i, "client" + std::to_string(i));
  }
  EXPECT_EQ(ports_.replies.size(),
            100 - (limits::kWaitingTraces - limits::kWaitingTracesOfConnection));
  EXPECT_EQ(orders().size(), limits::kRunningTraces);
}

TEST_F(ServiceTraceTest, AReaderMayRequestOne) {
  hello();
  ask(trace_request(7, 3), "client",
      std::make_shared<const KeyIdentity>(KeyIdentity{"onlooker", protocol::Role::kReader}));
  EXPECT_EQ(orders().size(), 1U);
}

TEST_F(ServiceTraceTest, AFaultyTraceFailsTheRequestAndNothingElse) {
  hello();
  std::uint64_t asked = 0;
  const auto with = [&](const std::function<void(protocol::Trace&)>& change) {
    ++asked;
    ask(asked, asked);
    protocol::Trace trace = trace_of(orders().back(), "\2\3");
    change(trace);
    worker_sends(trace);
    return refusal();
  };
  EXPECT_THAT(with([](auto& trace) { trace.add_values(1.0); }), HasSubstr("other columns"));
  EXPECT_THAT(with([](auto& trace) { trace.set_states("\2\5"); }),
              HasSubstr("a state that no contact has"));
  EXPECT_THAT(with([](auto& trace) { trace.set_states("\4\2"); }),
              HasSubstr("rows of the fall that were not requested"));
  EXPECT_THAT(with([](auto& trace) { trace.set_states("\2\4"); }), HasSubstr("falls again"));
  EXPECT_THAT(with([](auto& trace) { trace.set_values(0, std::nan("")); }),
              HasSubstr("not finite"));
  EXPECT_THAT(with([](auto& trace) { trace.mutable_result()->add_reals(1.0); }),
              HasSubstr("sent no trace"));
  EXPECT_THAT(with([](auto& trace) {
                trace.clear_values();
                trace.clear_states();
              }),
              HasSubstr("no instant"));
  worker_sends(trace_of({}, ""));  // of no order
  ask(99, 60);
  worker_sends(trace_of(orders().back(), "\2"));
  EXPECT_TRUE(last_reply().has_trace());
}

TEST_F(ServiceTraceTest, APointOfALongRecipeIsFoundOnAThreadOfItsOwn) {
  ClientRequest message = submit_request("long", 10);
  auto& axis = *message.mutable_submit()->mutable_recipe()->mutable_blocks(0)->mutable_axes(0);
  axis.clear_count();
  for (int i = 0; i < 10'000; ++i) {
    axis.add_values(0.1 + 1e-5 * i);
  }
  request(message);
  run_checks();
  write_all();
  request(change_request("long", protocol::STUDY_CHANGE_CANCEL));  // its table is given up
  write_all();
  hello();
  ports_.replies.clear();
  ask(trace_request(7, 25, "long"));
  ASSERT_EQ(ports_.checks.size(), 1U);
  EXPECT_TRUE(orders().empty());
  run_checks();
  ASSERT_EQ(orders().size(), 1U);
}

TEST_F(ServiceTraceTest, AStoppingServerAnswersThoseWhoWait) {
  hello();
  ask(7, 3);
  service_->stop(now_);
  EXPECT_THAT(refusal(), HasSubstr("stopping"));
  ask(8, 3);
  EXPECT_EQ(last_reply().request_id(), 8U);
  EXPECT_THAT(refusal(), HasSubstr("stopping"));
}

}  // namespace
}  // namespace oblique::server
