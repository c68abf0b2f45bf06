// Traces as the service sees them: who asks, who solves, who is gone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
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
    ClientRequest message = client_request(id);
    message.mutable_trace()->set_study(study);
    message.mutable_trace()->set_point(point);
    return message;
  }
  void ask(const ClientRequest& message, const std::string& identity = "client",
           const std::shared_ptr<const KeyIdentity>& holder = nullptr) {
    service_->client_frame(identity, protocol::encode(message), now_, holder);
  }
  void ask(std::uint64_t id, std::uint64_t point, const std::string& identity = "client") {
    ask(trace_request(id, point), identity);
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

  std::uint64_t asked_ = 0;

  static protocol::TracePart part_of(const protocol::TraceOrder& order, std::size_t rows) {
    const auto shape = solver::trace_shape(
        static_cast<std::size_t>(order.model().lengths_m_size()),
        static_cast<std::size_t>(order.model().elements_per_link()), order.shape());
    protocol::TracePart part;
    part.set_trace_id(order.trace_id());
    for (std::size_t i = 0; i < rows * solver::trace_numbers(shape); ++i) {
      part.mutable_rows()->add_values(static_cast<double>(i));
    }
    part.mutable_rows()->set_states(std::string(rows, '\x02'));
    return part;
  }
  static protocol::TracePart end_of(const protocol::TraceOrder& order, std::size_t rows) {
    protocol::TracePart part = part_of(order, rows);
    part.set_last(true);
    *part.mutable_result() = solved_point(0);
    return part;
  }
  static protocol::TracePart not_taken(const protocol::TraceOrder& order) {
    protocol::TracePart part;
    part.set_trace_id(order.trace_id());
    part.set_last(true);
    part.set_not_taken(true);
    return part;
  }
  void worker_sends(const protocol::TracePart& part, const std::string& identity = "worker") {
    WorkerMessage message;
    *message.mutable_trace_part() = part;
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

TEST_F(ServiceTraceTest, APointGoesToAWorkerBesideItsBatchesAndTheAnswerToTheOneWhoAsked) {
  hello();
  credit(2);
  ask(7, 3);
  ASSERT_EQ(orders().size(), 1U);
  const auto order = orders()[0];
  EXPECT_EQ(order.h_m(), 1.0);
  EXPECT_DOUBLE_EQ(order.mu(), 3.0 / 99.0);
  worker_sends(part_of(order, 2));
  EXPECT_TRUE(ports_.replies.empty());
  worker_sends(end_of(order, 1));
  ASSERT_EQ(ports_.replies.size(), 1U);
  EXPECT_EQ(last_reply().request_id(), 7U);
  const auto trace = last_reply().trace();
  EXPECT_EQ(trace.total_rows(), 3U);
  EXPECT_EQ(trace.rows().states(), std::string(3, '\x02'));
  EXPECT_EQ(trace.mu(), order.mu());
  EXPECT_EQ(trace.solver_version(), "1.0");
  EXPECT_EQ(trace.outputs(), protocol::sent_outputs());
  EXPECT_EQ(trace.result().reals_size(), solved_point(0).reals_size());
}

TEST_F(ServiceTraceTest, ATraceIsSolvedOnceAndKeptForWhoAsksAgainOrForMore) {
  hello();
  ask(7, 3);
  ask(7, 3, "another");
  ASSERT_EQ(orders().size(), 1U) << "they share it";
  worker_sends(end_of(orders()[0], 10));
  EXPECT_EQ(ports_.replies.size(), 2U);
  auto rest = trace_request(8, 3);
  rest.mutable_trace()->set_first_row(7);
  ask(rest);
  EXPECT_EQ(orders().size(), 1U);
  EXPECT_EQ(last_reply().trace().rows().states().size(), 3U);
  EXPECT_EQ(last_reply().trace().total_rows(), 10U);
  EXPECT_FALSE(last_reply().trace().has_result()) << "it came with the first rows";
  auto beyond = trace_request(9, 3);
  beyond.mutable_trace()->set_first_row(UINT64_MAX);
  ask(beyond);
  EXPECT_EQ(last_reply().trace().rows().states().size(), 0U);
  auto shape = trace_request(10, 3);
  shape.mutable_trace()->set_shape(true);
  ask(shape);
  EXPECT_EQ(orders().size(), 2U) << "with the shape it is another trace";
}

TEST_F(ServiceTraceTest, WhatThePointIsIsSaidWithoutAnyWorker) {
  auto message = trace_request(7, 99);
  message.mutable_trace()->set_only_point(true);
  ask(message);
  EXPECT_EQ(last_reply().trace().mu(), 1.0);
  EXPECT_EQ(last_reply().trace().model().lengths_m_size(), 3);
  EXPECT_FALSE(last_reply().trace().has_result());
}

TEST_F(ServiceTraceTest, WhatIsNotThereIsNamed) {
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

TEST_F(ServiceTraceTest, APointWithoutAnAnswerIsTriedEachTimeItIsAskedFor) {
  hello();
  ask(7, 3);
  protocol::TracePart end = end_of(orders()[0], 0);
  *end.mutable_result() = protocol::failed_point(0, "it slides for ever");
  worker_sends(end);
  EXPECT_EQ(last_reply().trace().result().error(), "it slides for ever");
  EXPECT_EQ(last_reply().trace().rows().states().size(), 0U);
  ask(8, 3);
  EXPECT_EQ(orders().size(), 2U);
}

TEST_F(ServiceTraceTest, WithoutAWorkerItIsRefusedAtOnce) {
  ask(7, 3);
  EXPECT_THAT(refusal(), HasSubstr("no worker is connected"));
}

TEST_F(ServiceTraceTest, AWorkerThatIsLostIsReplacedOnceAndThenThePointIsLeftAlone) {
  hello("one");
  ask(7, 3);
  hello("two");
  worker_sends(part_of(orders()[0], 5), "one");
  goodbye("one");
  ASSERT_EQ(orders().size(), 2U);
  EXPECT_TRUE(ports_.replies.empty());
  hello("three");
  goodbye("two");
  EXPECT_THAT(refusal(), HasSubstr("two workers were lost"));
  ask(8, 3);
  EXPECT_THAT(refusal(), HasSubstr("two workers were lost"));
  EXPECT_EQ(orders().size(), 2U);
  ask(9, 4);
  EXPECT_EQ(orders().size(), 3U) << "other points are solved";
}

TEST_F(ServiceTraceTest, WhatTheLostWorkerHadSentIsNotMixedIn) {
  hello("one");
  ask(7, 3);
  hello("two");
  worker_sends(part_of(orders()[0], 5), "one");
  goodbye("one");
  worker_sends(end_of(orders()[1], 4), "two");
  EXPECT_EQ(last_reply().trace().total_rows(), 4U);
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

TEST_F(ServiceTraceTest, NobodyWaitsForTheTraceOfAClientThatIsGone) {
  hello();
  ask(7, 3);
  service_->client_left("client");
  EXPECT_EQ(cancels(), 1U);
  ask(8, 4, "another");
  EXPECT_EQ(orders().size(), 1U) << "the worker has not said that it is free";
  worker_sends(not_taken(orders()[0]));
  EXPECT_EQ(orders().size(), 2U);
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

TEST_F(ServiceTraceTest, OneWhoAsksForManyAtOnceHasAShareAndOthersTheRest) {
  hello();
  for (std::uint64_t i = 0; i < 100; ++i) {
    ask(i, i);
  }
  EXPECT_EQ(ports_.replies.size(), 96U);
  EXPECT_THAT(refusal(), HasSubstr("too many traces"));
  for (std::uint64_t i = 0; i < 100; ++i) {
    ask(1, i, "client" + std::to_string(i));
  }
  EXPECT_EQ(ports_.replies.size(), 96U + 40U) << "64 wait in all";
  EXPECT_EQ(orders().size(), 1U) << "a worker has one at a time";
}

TEST_F(ServiceTraceTest, WhoAsksAnewForTheTraceThatHeWaitsForTakesNoMoreOfHisShare) {
  hello();
  for (std::uint64_t i = 0; i < 100; ++i) {
    ask(i, 3);
  }
  EXPECT_EQ(ports_.replies.size(), 100U - 32U) << "others may wait, too";
  for (std::uint64_t i = 0; i < 8; ++i) {
    ask(i, 3 + i % 4, "another");
  }
  EXPECT_EQ(ports_.replies.size(), 100U - 32U);
  ask(9, 9, "another");
  EXPECT_THAT(refusal(), HasSubstr("too many traces")) << "a fifth trace";
}

TEST_F(ServiceTraceTest, WhoHasAKeyHasOneShareHoweverManyConnectionsThatIs) {
  hello();
  const auto reader =
      std::make_shared<const KeyIdentity>(KeyIdentity{"onlooker", protocol::Role::kReader});
  for (std::uint64_t i = 0; i < 4; ++i) {
    ask(trace_request(i, i), "client" + std::to_string(i), reader);
  }
  EXPECT_TRUE(ports_.replies.empty()) << "who may only look may look at this too";
  ask(trace_request(5, 5), "client5", reader);
  EXPECT_THAT(refusal(), HasSubstr("too many traces"));
}

TEST_F(ServiceTraceTest, WhatNoWorkerSendsFailsTheTraceAndNothingElse) {
  hello();
  const auto with = [&](const std::function<void(protocol::TracePart&)>& change) {
    ++asked_;
    ask(asked_, asked_);
    protocol::TracePart part = end_of(orders().back(), 2);
    change(part);
    worker_sends(part);
    return refusal();
  };
  EXPECT_THAT(with([](auto& part) { part.mutable_rows()->add_values(1.0); }),
              HasSubstr("other columns"));
  EXPECT_THAT(with([](auto& part) { part.mutable_rows()->set_states("\x02\x05"); }),
              HasSubstr("a state that no contact has"));
  EXPECT_THAT(with([](auto& part) { part.mutable_rows()->set_values(0, std::nan("")); }),
              HasSubstr("not finite"));
  EXPECT_THAT(with([](auto& part) { part.mutable_result()->add_reals(1.0); }),
              HasSubstr("sent no trace"));
  EXPECT_THAT(with([](auto& part) { part.clear_rows(); }), HasSubstr("no instant"));
  ask(99, 60);
  const auto order = orders().back();
  worker_sends(end_of({}, 0));  // of no order
  for (int i = 0; i < 60; ++i) {
    worker_sends(part_of(order, 1000));  // 60 000 rows of 176 bytes are more than 8 MiB
  }
  EXPECT_THAT(refusal(), HasSubstr("more rows than a trace may have"));
  ask(98, 61);
  EXPECT_NE(orders().back().trace_id(), orders()[orders().size() - 2].trace_id())
      << "and after its last part the worker gets the next one";
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
