// Tests of answers about a study and of the requests for them. The test takes the service's role.
#include "server/web/answers/study_answers.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "proto/wire/chunk.h"
#include "server/study/limits.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using protocol::ClientReply;
using protocol::ClientRequest;
using testing::ElementsAre;
using testing::IsEmpty;

/// An answer that runs `queries` queries and lists the points in the first column of all rows.
class Points : public StudyAnswer {
 public:
  explicit Points(int queries = 1, const std::string& condition = {})
      : StudyAnswer(condition), queries_(queries) {}
  Next next(const ServedStudy& /*study*/) override {
    return queries_-- > 0 ? Next(protocol::StudyQuery()) : Next(HttpAnswer{200, {}, points_});
  }
  void take_row(const protocol::ChunkRows& row) override {
    points_ += std::to_string(row.cell(0).integer) + ' ';
  }

 private:
  int queries_;
  std::string points_;
};

class StudyFlowTest : public testing::Test {
 protected:
  /// Returns the requests since the last call.
  std::vector<ClientRequest> requested() {
    std::vector<ClientRequest> requests;
    for (std::vector<std::string> frames = client_.take(); !frames.empty();
         frames = client_.take()) {
      for (const std::string& frame : frames) {
        EXPECT_TRUE(protocol::decode(frame, requests.emplace_back()));
      }
    }
    return requests;
  }
  /// Returns the numbers of the queries that were ended since the last call.
  std::vector<std::uint64_t> ended() {
    std::vector<std::uint64_t> numbers;
    for (const ClientRequest& request : requested()) {
      if (request.has_end_query()) {
        numbers.push_back(request.end_query().request_id());
      }
    }
    return numbers;
  }
  void reply(std::uint64_t number, ClientReply reply) {
    reply.set_request_id(number);
    client_.put(protocol::encode(reply));
  }
  /// Answers the last request for the status of a study.
  void reply_with_status(std::uint64_t points = 0) {
    ClientReply status;
    status.mutable_status()->add_studies()->set_name("a");
    status.mutable_status()->mutable_studies(0)->set_points(points);
    reply(requested().at(0).request_id(), status);
  }
  /// Answers the requests for the study and its recipe.
  void describe(const PendingAnswer& pending) {
    reply_with_status();
    EXPECT_FALSE(pending());
    ClientReply described;
    *described.mutable_describe()->mutable_recipe() = protocol::recipe_of(
        {{protocol::listed("H", {1}), protocol::listed("mu", {1}), protocol::listed("e", {1})}});
    const auto requests = requested();
    EXPECT_EQ(requests.at(0).describe().study(), "a");
    reply(requests.at(0).request_id(), described);
  }
  /// Returns a pending answer. Its first query has been sent.
  PendingAnswer described(int queries = 1, const std::string& condition = {}) {
    PendingAnswer pending = study_flow(client_, 1, std::make_unique<Points>(queries, condition));
    describe(pending);
    EXPECT_FALSE(pending());
    return pending;
  }
  static ClientReply chunk_of(const std::vector<std::int64_t>& points, bool ends) {
    protocol::ChunkWriter rows({"point"});
    for (const std::int64_t point : points) {
      rows.integer(point);
      rows.end_row();
    }
    ClientReply reply;
    *reply.mutable_query() = rows.take();
    reply.mutable_query()->set_ends(ends);
    return reply;
  }
  static ClientReply error_of(const std::string& message) {
    ClientReply reply;
    reply.mutable_error()->set_message(message);
    reply.mutable_error()->set_code(protocol::ERROR_CODE_WRONG_REQUEST);
    return reply;
  }
  ServiceClient client_;
};

TEST_F(StudyFlowTest, AnAnswerIsMadeOfAllChunksOfAQuery) {
  const PendingAnswer pending = described();
  const ClientRequest query = requested().at(0);
  EXPECT_EQ(query.query().question().study(), "a");
  reply(query.request_id(), chunk_of({1, 2}, false));
  EXPECT_FALSE(pending());
  const ClientRequest more = requested().at(0);
  EXPECT_EQ(more.more_rows().request_id(), query.request_id());
  EXPECT_EQ(more.more_rows().received(), 1U);
  reply(query.request_id(), chunk_of({5}, true));
  EXPECT_EQ(pending()->body, "1 2 5 ");
}

TEST_F(StudyFlowTest, ALateErrorAboutAQueryThatHasEndedDoesNotEndTheNext) {
  const PendingAnswer pending = described(2);
  const std::uint64_t first = requested().at(0).request_id();
  reply(first, chunk_of({1}, false));
  reply(first, chunk_of({}, true));
  EXPECT_FALSE(pending());
  const std::uint64_t second = requested().back().request_id();
  reply(first, error_of("no query of this connection has that request number"));
  EXPECT_FALSE(pending());
  reply(second, chunk_of({2}, true));
  EXPECT_EQ(pending()->body, "1 2 ");
}

TEST_F(StudyFlowTest, TheQueryOfADisconnectedClientEnds) {
  PendingAnswer pending = described();
  const ClientRequest query = requested().at(0);
  pending = nullptr;
  EXPECT_THAT(ended(), ElementsAre(query.request_id()));
}

TEST_F(StudyFlowTest, ARecipeIsRequestedOnceUntilTheStudyGrows) {
  const auto requests_with_points = [&](std::uint64_t points) {
    const PendingAnswer pending = study_flow(client_, 1, std::make_unique<Points>(0));
    reply_with_status(points);
    const bool is_answered = pending().has_value();
    const std::size_t requests = requested().size();
    EXPECT_EQ(is_answered, requests == 0);
    return requests;
  };
  const PendingAnswer first = study_flow(client_, 1, std::make_unique<Points>(0));
  describe(first);
  EXPECT_TRUE(first());
  EXPECT_EQ(requests_with_points(1), 0U);
  EXPECT_EQ(requests_with_points(2), 1U);
}

TEST_F(StudyFlowTest, FewRecipesAreRequestedAtATime) {
  std::vector<PendingAnswer> flows;
  for (std::uint64_t study = 1; study <= limits::kRecipesOfPage + 1; ++study) {
    flows.push_back(study_flow(client_, study, std::make_unique<Points>(0)));
    reply_with_status();
    EXPECT_FALSE(flows.back()());
    EXPECT_EQ(requested().size(), study <= limits::kRecipesOfPage ? 1U : 0U) << study;
  }
  flows.front() = nullptr;
  EXPECT_FALSE(flows.back()());
  EXPECT_TRUE(requested().at(0).has_describe());
}

TEST_F(StudyFlowTest, FewTracesAreRequestedOrSentAtATime) {
  std::vector<PendingAnswer> flows;
  for (std::size_t i = 0; i <= limits::kTracesOfPage; ++i) {
    flows.push_back(solve_trace(client_, 1, i, {}));
    EXPECT_FALSE(flows.back()());
  }
  const auto requests = requested();
  ASSERT_EQ(requests.size(), limits::kTracesOfPage);
  ClientReply status;
  status.mutable_status()->add_studies()->set_name("a");
  reply(requests.at(0).request_id(), status);
  EXPECT_FALSE(flows.front()());
  ClientReply trace;
  trace.mutable_trace()->mutable_trace()->mutable_result()->set_error("it has none");
  reply(requested().at(0).request_id(), trace);
  auto answer = flows.front()();
  ASSERT_TRUE(answer);
  flows.front() = nullptr;
  EXPECT_FALSE(flows.back()());
  EXPECT_THAT(requested(), IsEmpty()) << "the first query is not sent yet";
  answer.reset();
  EXPECT_FALSE(flows.back()());
  EXPECT_EQ(requested().size(), 1U);
}

TEST_F(StudyFlowTest, AnAnswerAfterItsDeadlineIsAnError) {
  const PendingAnswer pending =
      study_flow(client_, 1, std::make_unique<Points>(), FlowClock::now());
  EXPECT_EQ(pending()->status, 503U);
}

TEST_F(StudyFlowTest, AnErrorAboutAConditionShowsItUnchanged) {
  for (const bool is_condition_wrong : {true, false}) {
    const PendingAnswer pending = described(1, "muu > 1");
    reply(requested().at(0).request_id(), error_of("wrong in the whole query"));
    EXPECT_FALSE(pending());
    const ClientRequest alone = requested().at(0);
    EXPECT_EQ(alone.query().question().where(), "muu > 1");
    reply(alone.request_id(),
          is_condition_wrong ? error_of("wrong as written") : chunk_of({}, true));
    const auto answer = pending();
    EXPECT_EQ(answer->status, 400U);
    EXPECT_THAT(answer->body, testing::HasSubstr(is_condition_wrong ? "wrong as written"
                                                                    : "wrong in the whole query"));
  }
}

TEST_F(StudyFlowTest, ATraceWhoseBrowserDisconnectedEndsUnlessItIsComplete) {
  ClientRequest trace;
  trace.mutable_trace()->set_study("a");
  client_.ask(1, trace);
  client_.forget(1);
  EXPECT_THAT(ended(), ElementsAre(1));
  client_.ask(2, trace);
  ClientReply whole;
  whole.mutable_trace()->set_worker("one");
  reply(2, whole);
  ASSERT_TRUE(client_.reply(2));
  client_.forget(2);
  EXPECT_THAT(ended(), IsEmpty());
}

}  // namespace
}  // namespace oblique::server
