// Tests of requests that take long: checks of recipes, queries and traces.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "proto/wire/chunk.h"
#include "server/study/limits.h"
#include "tests/server/service/service_fixture.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

// ---- Checks ----

TEST_F(ServiceTest, ALongRecipeIsCheckedWithoutDelayingOthers) {
  request(long_submission("large", kLongRequest));
  ASSERT_EQ(ports_.checks.size(), 1U);
  EXPECT_TRUE(ports_.replies.empty());
  submit("small");
  EXPECT_TRUE(last_reply().has_submit());
  EXPECT_EQ(statuses().studies_size(), 1);
  run_checks();
  write_all();
  EXPECT_EQ(last_reply().request_id(), 7U);
  EXPECT_TRUE(last_reply().submit().created());
}

TEST_F(ServiceTest, ALongRecipeWithAFaultIsRefusedWithTheReason) {
  ClientRequest bad = long_submission("a", kLongRequest);
  bad.mutable_submit()->mutable_recipe()->mutable_blocks(0)->mutable_axes(2)->set_values(0, 1.5);
  request(bad);
  run_checks();
  EXPECT_EQ(last_reply().request_id(), 7U);
  EXPECT_THAT(last_error(), HasSubstr("e = 1.5"));
  EXPECT_TRUE(ports_.jobs.empty());
}

TEST_F(ServiceTest, WaitingLongRequestsAreLimited) {
  const std::string frame = protocol::encode(long_submission("a", std::size_t{10} << 20U));
  for (int i = 0; i < 12; ++i) {
    service_->client_frame("client " + std::to_string(i), frame, now_);
  }
  EXPECT_EQ(ports_.checks.size(), limits::kWaitingCheckBytes / frame.size());
  EXPECT_THAT(last_error(), HasSubstr("try again later"));
  run_checks();
  request(long_submission("b", kLongRequest));
  EXPECT_EQ(ports_.checks.size(), 1U) << "finished checks make room for others";
}

TEST_F(ServiceTest, AnInvalidLongFrameIsAnsweredWithItsRequestNumber) {
  std::string frame = protocol::encode(long_submission("a", kLongRequest));
  frame.back() = '\x7f';
  frame += '\x7f';
  service_->client_frame("client", frame, now_);
  run_checks();
  EXPECT_EQ(last_reply().request_id(), 7U);
  EXPECT_TRUE(last_reply().has_error());
  EXPECT_EQ(service_->bad_frames(), 1U);
}

// ---- Queries ----

/// Returns a chunk of an answer, encoded as a reply.
std::string reply_of(const protocol::QueryReply& query) {
  protocol::ClientReply reply;
  *reply.mutable_query() = query;
  return protocol::encode(reply);
}

class ServiceQueryTest : public ServiceTest {
 protected:
  void request_query(std::uint64_t request_id, const std::string& identity = "client") {
    ClientRequest message = client_request(request_id);
    message.mutable_query()->set_sql("SELECT 1");
    send(message, identity);
  }
  void want_more(std::uint64_t request_id, std::uint64_t taken,
                 const std::string& identity = "client") {
    ClientRequest message = client_request(request_id);
    message.mutable_more_rows()->set_request_id(request_id);
    message.mutable_more_rows()->set_received(taken);
    send(message, identity);
  }
  /// Lets the reader of the `index`-th query deliver one more chunk.
  void give(std::size_t index) {
    protocol::QueryReply chunk;
    chunk.set_chunk_rows(1);
    service_->query_report(
        {QueryReport::Kind::kRows, ports_.queries.at(index).ticket, reply_of(chunk)});
  }
};

TEST_F(ServiceQueryTest, AClientGetsStillWorkingEverySecondForItsQuery) {
  request_query(7);
  pass(900);
  EXPECT_TRUE(ports_.replies.empty());
  pass(100);
  ASSERT_EQ(ports_.replies.size(), 1U);
  EXPECT_EQ(last_reply().request_id(), 7U);
  EXPECT_FALSE(last_reply().still_working().runs());
  service_->query_report({QueryReport::Kind::kBegun, ports_.queries[0].ticket, {}});
  pass(1000);
  ASSERT_EQ(ports_.replies.size(), 2U);
  EXPECT_TRUE(last_reply().still_working().runs());
  answer_query(0, encoded_error("no such column"));
  const auto replies = ports_.replies.size();
  pass(5000);
  EXPECT_EQ(ports_.replies.size(), replies);
}

TEST_F(ServiceQueryTest, OnlyTheQueriesOfADisconnectedClientAreCancelled) {
  for (const bool leaves : {true, false}) {
    start({});
    ports_ = {};
    request_query(7);
    request_query(8, "another");
    if (leaves) {
      service_->client_left("client");
    } else {
      ports_.unreachable = "client";
      pass(1000);
    }
    EXPECT_EQ(ports_.cancelled_queries, std::vector{ports_.queries[0].ticket});
    ports_.replies.clear();
    answer_query(0, encoded_error("too late"));
    EXPECT_TRUE(ports_.replies.empty());
    answer_query(1, encoded_error("in time"));
    EXPECT_EQ(last_reply().request_id(), 8U);
    EXPECT_EQ(last_error(), "in time");
  }
}

TEST_F(ServiceQueryTest, TooManyQueriesAreRefusedAndARepeatedOneRunsOnce) {
  request_query(7);
  request_query(7);
  EXPECT_EQ(ports_.queries.size(), 1U);
  request_query(7, "another");
  EXPECT_EQ(ports_.queries.size(), 2U);
  EXPECT_TRUE(ports_.replies.empty());
  request_query(8);
  EXPECT_THAT(last_error(), HasSubstr("too many queries"));
  EXPECT_EQ(last_reply().request_id(), 8U);
}

TEST_F(ServiceQueryTest, ChunksAreForwardedAndTheirConfirmationsPassedToTheReaders) {
  using Taken = std::vector<std::pair<std::uint64_t, std::uint64_t>>;
  request_query(7);
  give(0);
  give(0);
  EXPECT_EQ(ports_.replies.size(), 2U);
  EXPECT_EQ(last_reply().request_id(), 7U);
  want_more(7, 1);
  want_more(7, 1);
  want_more(7, 2);
  want_more(7, 1);
  EXPECT_EQ(ports_.queries[0].client, "client");
  const std::uint64_t ticket = ports_.queries[0].ticket;
  EXPECT_EQ(ports_.more, (Taken{{ticket, 1}, {ticket, 2}}));
  answer_query(0, reply_of({}));
  EXPECT_EQ(ports_.replies.size(), 3U);
  want_more(7, 3);
  EXPECT_THAT(last_error(), testing::HasSubstr("no query"));
  EXPECT_EQ(last_reply().request_id(), 7U);
}

TEST_F(ServiceQueryTest, ConfirmingUnsentChunksEndsTheAnswer) {
  request_query(7);
  give(0);
  want_more(7, UINT64_MAX);
  EXPECT_THAT(last_error(), testing::HasSubstr("than were sent"));
  EXPECT_EQ(ports_.cancelled_queries, std::vector{ports_.queries[0].ticket});
  EXPECT_TRUE(ports_.more.empty());
}

TEST_F(ServiceQueryTest, AnswersOfOtherClientsCanBeNeitherConfirmedNorEnded) {
  request_query(7);
  give(0);
  want_more(7, 1, "another");
  EXPECT_THAT(last_error(), testing::HasSubstr("no query"));
  end(7, "another");
  EXPECT_TRUE(ports_.more.empty());
  EXPECT_TRUE(ports_.cancelled_queries.empty());
}

TEST_F(ServiceQueryTest, EndQueryCancelsTheAnswerWithoutAReply) {
  request_query(7);
  give(0);
  end(7);
  EXPECT_EQ(ports_.cancelled_queries, std::vector{ports_.queries[0].ticket});
  give(0);
  EXPECT_EQ(ports_.replies.size(), 1U);
  end(7);
  EXPECT_EQ(ports_.replies.size(), 1U);
}

TEST_F(ServiceQueryTest, StillWorkingIsNotSentWhileTheClientIsSlow) {
  request_query(7);
  for (std::uint64_t i = 0; i < kChunksAhead; ++i) {
    give(0);
  }
  pass(10'000);
  EXPECT_EQ(ports_.replies.size(), kChunksAhead);
  want_more(7, 1);
  pass(1000);
  EXPECT_TRUE(last_reply().has_still_working());
}

// ---- Traces ----

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
    message.mutable_trace()->set_every(1);
    return message;
  }
  void request_trace(std::uint64_t id, std::uint64_t point,
                     const std::string& identity = "client") {
    send(trace_request(id, point), identity);
  }

  /// Returns the trace orders that the service has sent to workers.
  std::vector<protocol::TraceOrder> orders() const {
    std::vector<protocol::TraceOrder> found;
    for (const ServerToWorker& message : ports_.worker_messages) {
      if (message.has_trace_order()) {
        found.push_back(message.trace_order());
      }
    }
    return found;
  }
  std::ptrdiff_t cancels() const {
    return std::ranges::count_if(ports_.worker_messages,
                                 [](const auto& message) { return message.has_trace_cancel(); });
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
  static protocol::Trace declined(const protocol::TraceOrder& order) {
    protocol::Trace trace;
    trace.set_trace_id(order.trace_id());
    trace.set_declined(true);
    return trace;
  }
  void worker_sends_trace(const protocol::Trace& trace, const std::string& identity = "worker") {
    WorkerMessage message;
    *message.mutable_trace() = trace;
    worker_sends(message, identity);
  }
  void goodbye(const std::string& identity) {
    WorkerMessage message;
    message.mutable_goodbye();
    worker_sends(message, identity);
  }
  void pass(std::int64_t duration_ms) {
    for (; duration_ms > 0; duration_ms -= 100) {
      credit(0);
      ServiceTest::pass(100);
    }
  }
};

TEST_F(ServiceTraceTest, AWorkerSolvesATraceBesideItsBatchesAndTheClientGetsIt) {
  hello();
  credit(2);
  auto message = trace_request(7, 3);
  message.mutable_trace()->set_fall(true);
  message.mutable_trace()->set_every(5);
  send(message, "client");
  ASSERT_EQ(orders().size(), 1U);
  const auto order = orders()[0];
  EXPECT_EQ(order.h_m(), 1.0);
  EXPECT_DOUBLE_EQ(order.mu(), 3.0 / 99.0);
  EXPECT_TRUE(order.fall());
  EXPECT_EQ(order.every(), 5U);
  worker_sends_trace(trace_of(order, "\4\2\3"));
  ASSERT_EQ(ports_.replies.size(), 1U);
  EXPECT_EQ(last_reply().request_id(), 7U);
  const auto reply = last_reply().trace();
  EXPECT_EQ(reply.trace().SerializeAsString(), trace_of(order, "\4\2\3").SerializeAsString());
  EXPECT_EQ(reply.mu(), order.mu());
  EXPECT_EQ(reply.solver_version(), "1.0");
  EXPECT_EQ(reply.outputs(), protocol::sent_outputs());
}

TEST_F(ServiceTraceTest, TheInputsOfAPointNeedNoWorker) {
  auto message = trace_request(7, 99);
  message.mutable_trace()->set_only_point(true);
  send(message, "client");
  EXPECT_EQ(last_reply().trace().mu(), 1.0);
  EXPECT_EQ(last_reply().trace().model().lengths_m_size(), 3);
  EXPECT_FALSE(last_reply().trace().has_trace());
}

TEST_F(ServiceTraceTest, ASolvedPointIsSolvedAgainWithTheInputsOfItsRow) {
  hello_and_credit();
  answer_batch(1);  // point 0 is solved, the others failed
  const double solved_H_m = std::nextafter(1.0, 2.0);
  const double solved_E_Pa = std::nextafter(70e9, 1e12);
  const auto answer = [](const protocol::Row& row) {
    ClientReply reply;
    *reply.mutable_query() = protocol::chunk_of({{"H", "mu", "e", "E_Pa", "links"}, {row}});
    return protocol::encode(reply);
  };
  request_trace(7, 0);
  ASSERT_EQ(ports_.queries.size(), 1U);
  EXPECT_THAT(ports_.queries[0].request.sql(), HasSubstr("point = 0"));
  EXPECT_TRUE(orders().empty());
  answer_query(0, answer({solved_H_m, 0.5, {}, solved_E_Pa, std::int64_t{3}}));
  ASSERT_EQ(orders().size(), 1U);
  EXPECT_EQ(orders()[0].h_m(), solved_H_m);
  EXPECT_EQ(orders()[0].model().e_pa(), solved_E_Pa);
  EXPECT_EQ(orders()[0].mu(), 0.0) << "a value that differs by more than rounding is ignored";
  auto message = trace_request(8, 0);
  message.mutable_trace()->set_only_point(true);
  send(message, "client");
  answer_query(1, answer({solved_H_m, 0.0, 1.0, 70e9, std::int64_t{3}}));
  EXPECT_EQ(last_reply().request_id(), 8U);
  EXPECT_EQ(last_reply().trace().h_m(), solved_H_m);
}

TEST_F(ServiceTraceTest, UnknownStudiesAndPointsAreNamed) {
  hello();
  send(trace_request(7, 0, "b"), "client");
  EXPECT_THAT(last_error(), HasSubstr("no study called \"b\""));
  EXPECT_EQ(last_reply().error().code(), protocol::ERROR_CODE_NO_SUCH_STUDY);
  send(trace_request(7, 0, std::string(100'000, 'x')), "client");
  EXPECT_LT(last_error().size(), 1000U);
  for (const std::uint64_t point : {std::uint64_t{100}, UINT64_MAX}) {
    request_trace(7, point);
    EXPECT_THAT(last_error(), HasSubstr("its points are 0 to 99"));
  }
  EXPECT_TRUE(orders().empty());
}

TEST_F(ServiceTraceTest, AFailedPointIsNotSolvedAgainBecauseItMayKillAWorker) {
  hello_and_credit();
  answer_batch(0);
  request_trace(7, 0);
  EXPECT_THAT(last_error(), HasSubstr("point 0 of the study \"a\" failed"));
  EXPECT_TRUE(orders().empty());
}

TEST_F(ServiceTraceTest,
       AnUnsolvedPointIsSolvedAtEachRequestAndATooLongTraceNamesTheIntervalThatFits) {
  hello();
  request_trace(7, 3);
  auto trace = trace_of(orders()[0], "\2");
  *trace.mutable_result() = protocol::failed_point(0, "it slides for ever");
  worker_sends_trace(trace);
  EXPECT_EQ(last_reply().trace().trace().result().error(), "it slides for ever");
  EXPECT_EQ(last_reply().trace().trace().states().size(), 0U);
  // If a trace is too long, the reply contains a value of `every` with which it would fit.
  request_trace(9, 3);
  trace = trace_of(orders()[1], "");
  trace.set_instants(1'000'000);
  trace.set_every(12);
  worker_sends_trace(trace);
  EXPECT_EQ(last_reply().trace().trace().instants(), 1'000'000U);
  EXPECT_EQ(last_reply().trace().trace().every(), 12U);
  auto with_shape = trace_request(8, 3);
  with_shape.mutable_trace()->set_shape(true);
  send(with_shape, "client");
  EXPECT_TRUE(orders().at(2).shape());
}

TEST_F(ServiceTraceTest, WithoutAWorkerATraceIsRefusedAtOnce) {
  request_trace(7, 3);
  EXPECT_THAT(last_error(), HasSubstr("no worker is connected"));
}

TEST_F(ServiceTraceTest, AWorkerThatIsLostOrDeclinesIsReplacedOnce) {
  for (const bool is_lost : {true, false}) {
    hello("one");
    request_trace(7, 3);
    hello("two");
    const auto first = orders().size() - 1;
    is_lost ? goodbye("one") : worker_sends_trace(declined(orders()[first]), "one");
    ASSERT_EQ(orders().size(), first + 2);
    EXPECT_TRUE(ports_.replies.empty());
    if (is_lost) {
      hello("three");
    }
    is_lost ? goodbye("two") : worker_sends_trace(declined(orders()[first + 1]), "two");
    EXPECT_THAT(last_error(), HasSubstr(is_lost ? "two workers were lost" : "no connected worker"));
    EXPECT_EQ(orders().size(), first + 2);
    goodbye("three");
    ports_.replies.clear();
  }
}

TEST_F(ServiceTraceTest, ATraceIsCancelledWhenItsClientDisconnectsOrEndsItsRequest) {
  hello();
  request_trace(7, 3);
  request_trace(7, 3);  // repeated
  end(8);
  end(7, "another");
  EXPECT_EQ(cancels(), 0);
  end(7);
  EXPECT_EQ(cancels(), 1);
  request_trace(8, 4);
  EXPECT_EQ(orders().size(), 1U) << "the worker has not yet declined its cancelled trace";
  worker_sends_trace(declined(orders()[0]));
  EXPECT_EQ(orders().size(), 2U);
  service_->client_left("client");
  EXPECT_EQ(cancels(), 2);
  EXPECT_TRUE(ports_.replies.empty());
}

TEST_F(ServiceTraceTest, AClientGetsStillWorkingEverySecondForItsTrace) {
  hello();
  request_trace(7, 3);
  request_trace(7, 4, "another");
  pass(1000);
  ASSERT_EQ(ports_.replies.size(), 2U);
  EXPECT_TRUE(ports_.replies[0].still_working().runs());
  EXPECT_FALSE(ports_.replies[1].still_working().runs());
  ports_.unreachable = "client";
  pass(1000);
  EXPECT_EQ(cancels(), 1) << "the trace of an unreachable client is cancelled";
}

TEST_F(ServiceTraceTest, ATraceHasATimeLimit) {
  hello();
  auto message = trace_request(7, 3);
  message.mutable_trace()->set_time_limit_ms(500);
  send(message, "client");
  pass(500);
  EXPECT_THAT(last_error(), HasSubstr("took too long"));
  EXPECT_EQ(cancels(), 1);
}

TEST_F(ServiceTraceTest, RunningAndWaitingTracesAreLimited) {
  for (const char* worker : {"one", "two", "three"}) {
    hello(worker);
  }
  for (std::uint64_t i = 0; i < 100; ++i) {
    request_trace(i, i);
  }
  EXPECT_EQ(ports_.replies.size(), 100 - limits::kWaitingTraces);
  EXPECT_THAT(last_error(), HasSubstr("too many traces"));
  EXPECT_EQ(orders().size(), limits::kRunningTraces);
}

TEST_F(ServiceTraceTest, ChecksOfPointsAreLimitedEvenIfTheirClientsAreGone) {
  StoredStudy study;
  study.study_id = 1;
  study.name = "a";
  study.table = StudyTable(std::string(limits::kLongestInlineRequest + 1, 'x'), 100);
  study.state = StudyState::kPaused;
  start({}, {study});
  for (std::size_t i = 0; i < limits::kWaitingTraces; ++i) {
    request_trace(1, 3);
    service_->client_left("client");
  }
  EXPECT_TRUE(ports_.replies.empty());
  request_trace(1, 3, "another");
  EXPECT_THAT(last_error(), HasSubstr("too many traces"));
  ports_.replies.clear();
  run_checks();
  EXPECT_TRUE(ports_.replies.empty()) << "no client waits for a reply";
  request_trace(1, 3, "another");
  run_checks();
  EXPECT_THAT(last_error(), HasSubstr("damaged"));
}

TEST_F(ServiceTraceTest, AnInvalidTraceFailsTheRequestAndNothingElse) {
  hello();
  std::uint64_t requested = 0;
  const auto with = [&](const std::function<void(protocol::Trace&)>& change) {
    ++requested;
    request_trace(requested, requested);
    protocol::Trace trace = trace_of(orders().back(), "\2\3");
    change(trace);
    worker_sends_trace(trace);
    return last_error();
  };
  EXPECT_THAT(with([](auto& trace) { trace.add_values(1.0); }), HasSubstr("other columns"));
  EXPECT_THAT(with([](auto& trace) { trace.set_states("\2\5"); }), HasSubstr("an unknown state"));
  EXPECT_THAT(with([](auto& trace) { trace.set_states("\4\2"); }),
              HasSubstr("rows of the fall, which were not requested"));
  EXPECT_THAT(with([](auto& trace) { trace.set_states("\2\4"); }), HasSubstr("after the touch"));
  EXPECT_THAT(with([](auto& trace) { trace.set_values(0, std::nan("")); }),
              HasSubstr("not finite"));
  EXPECT_THAT(with([](auto& trace) { trace.mutable_result()->add_reals(1.0); }),
              HasSubstr("sent an invalid trace"));
  EXPECT_THAT(with([](auto& trace) {
                trace.clear_values();
                trace.clear_states();
              }),
              HasSubstr("no rows"));
  worker_sends_trace(trace_of({}, ""));  // ignored, because the service did not order a trace
  request_trace(99, 60);
  worker_sends_trace(trace_of(orders().back(), "\2"));
  EXPECT_TRUE(last_reply().has_trace());
}

TEST_F(ServiceTraceTest, APointOfALongRecipeIsFoundOnTheCheckThread) {
  request(long_submission("long", kLongRequest));
  run_checks();
  write_all();
  request(change_request("long", protocol::STUDY_CHANGE_CANCEL));  // releases its table
  write_all();
  hello();
  ports_.replies.clear();
  send(trace_request(7, 25, "long"), "client");
  ASSERT_EQ(ports_.checks.size(), 1U);
  EXPECT_TRUE(orders().empty());
  run_checks();
  ASSERT_EQ(orders().size(), 1U);
}

TEST_F(ServiceTraceTest, AStoppingServerNotifiesWorkersAndRefusesRequests) {
  hello();
  for (const bool is_stopped : {false, true}) {
    ports_.replies.clear();
    request_trace(7, 3);
    request(long_submission("long", kLongRequest));
    ClientRequest query = client_request(8);
    query.mutable_query()->set_sql("SELECT 1");
    request(query);
    request(submit_request("short"));
    if (!is_stopped) {
      EXPECT_TRUE(ports_.replies.empty());
      write_all();
      ports_.replies.clear();
      service_->stop(now_);
      EXPECT_TRUE(std::ranges::any_of(ports_.worker_messages,
                                      [](const auto& message) { return message.has_stopping(); }));
    }
    ASSERT_EQ(ports_.replies.size(), is_stopped ? 4U : 3U);
    for (const ClientReply& reply : ports_.replies) {
      EXPECT_THAT(reply.error().message(), HasSubstr("stopping"));
    }
    run_checks();
    EXPECT_TRUE(ports_.jobs.empty());
  }
  const auto sent = ports_.worker_messages.size();
  credit(1);
  EXPECT_EQ(ports_.worker_messages.size(), sent) << "a batch was sent";
}

}  // namespace
}  // namespace oblique::server
