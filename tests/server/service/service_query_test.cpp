// Queries as the service sees them: who waits, who is told, who is gone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

/// The frame of an answer.
std::string reply_of(const protocol::QueryReply& query) {
  protocol::ClientReply reply;
  *reply.mutable_query() = query;
  return protocol::encode(reply);
}

class ServiceQueryTest : public ServiceTest {
 protected:
  void send(const ClientRequest& message, const std::string& identity) {
    service_->client_frame(identity, protocol::encode(message), now_);
  }
  void ask(std::uint64_t request_id, const std::string& identity = "client") {
    ClientRequest message = client_request(request_id);
    message.mutable_query()->set_sql("SELECT 1");
    send(message, identity);
  }
  void want_more(std::uint64_t request_id, std::uint64_t taken,
                 const std::string& identity = "client") {
    ClientRequest message = client_request(request_id);
    message.mutable_more_rows()->set_request_id(request_id);
    message.mutable_more_rows()->set_taken(taken);
    send(message, identity);
  }
  void end(std::uint64_t request_id, const std::string& identity = "client") {
    ClientRequest message = client_request(request_id);
    message.mutable_end_query()->set_request_id(request_id);
    send(message, identity);
  }
  /// A reader gives another chunk of the answer.
  void give(std::size_t index) {
    protocol::QueryReply chunk;
    chunk.set_chunk_rows(1);
    service_->query_report(
        {QueryReport::Kind::kRows, ports_.queries.at(index).ticket, reply_of(chunk)});
  }
};

TEST_F(ServiceQueryTest, AnAnswerGoesToTheOneWhoAskedUnderItsNumber) {
  ask(7);
  ASSERT_EQ(ports_.queries.size(), 1U);
  EXPECT_EQ(ports_.queries[0].client, "client");
  protocol::QueryReply rows;
  rows.add_columns("a");
  answer_query(0, reply_of(rows));
  EXPECT_EQ(last_reply().request_id(), 7U);
  EXPECT_EQ(last_reply().query().columns(0), "a");
}

TEST_F(ServiceQueryTest, AClientHearsEverySecondThatItsQueryWaitsOrRuns) {
  ask(7);
  pass(900);
  EXPECT_TRUE(ports_.replies.empty());
  pass(100);
  ASSERT_EQ(ports_.replies.size(), 1U);
  EXPECT_EQ(last_reply().request_id(), UINT64_MAX);
  EXPECT_EQ(last_reply().still_working().request_id(), 7U);
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

TEST_F(ServiceQueryTest, TheQueryOfAClientThatIsGoneIsCancelled) {
  ask(7);
  ports_.unreachable = "client";
  pass(1000);
  EXPECT_EQ(ports_.cancelled_queries, std::vector{ports_.queries[0].ticket});
  pass(5000);
  EXPECT_EQ(ports_.cancelled_queries.size(), 1U);
  answer_query(0, encoded_error("too late"));
  EXPECT_TRUE(ports_.replies.empty());
}

TEST_F(ServiceQueryTest, TheQueriesOfAClientThatLeavesAreCancelledAtOnceAndNobodyElses) {
  ask(7);
  ask(8, "another");
  service_->client_left("client");
  EXPECT_EQ(ports_.cancelled_queries, std::vector{ports_.queries[0].ticket});
  answer_query(0, encoded_error("too late"));
  EXPECT_TRUE(ports_.replies.empty());
  answer_query(1, encoded_error("in time"));
  EXPECT_EQ(last_reply().request_id(), 8U);
}

TEST_F(ServiceQueryTest, AQueryAskedTwiceUnderOneNumberRunsOnce) {
  ask(7);
  ask(7);
  EXPECT_EQ(ports_.queries.size(), 1U);
  ask(7, "another");
  EXPECT_EQ(ports_.queries.size(), 2U);
}

TEST_F(ServiceQueryTest, AStoppingServerAnswersThoseWhoWait) {
  ask(7);
  service_->stop(now_);
  EXPECT_EQ(last_reply().request_id(), 7U);
  EXPECT_THAT(last_reply().error().message(), testing::HasSubstr("stopping"));
  ask(8);
  EXPECT_EQ(ports_.queries.size(), 1U);
  EXPECT_EQ(last_reply().request_id(), 8U);
  EXPECT_THAT(last_reply().error().message(), testing::HasSubstr("stopping"));
}

TEST_F(ServiceQueryTest, PartsOfAnAnswerGoOutAsTheyComeAndMoreIsAskedOfTheReaders) {
  using Taken = std::vector<std::pair<std::uint64_t, std::uint64_t>>;
  ask(7);
  give(0);
  give(0);
  EXPECT_EQ(ports_.replies.size(), 2U);
  EXPECT_EQ(last_reply().request_id(), 7U);
  want_more(7, 1);
  want_more(7, 1);
  want_more(7, 2);
  want_more(7, 1);
  const std::uint64_t ticket = ports_.queries[0].ticket;
  EXPECT_EQ(ports_.more, (Taken{{ticket, 1}, {ticket, 2}}));
  answer_query(0, reply_of({}));
  EXPECT_EQ(ports_.replies.size(), 3U);
  want_more(7, 3);
  EXPECT_THAT(last_reply().error().message(), testing::HasSubstr("no answer"));
  EXPECT_EQ(last_reply().request_id(), 7U);
}

TEST_F(ServiceQueryTest, WhoSaysToHaveTakenWhatWasNotGivenLosesTheAnswer) {
  ask(7);
  give(0);
  want_more(7, UINT64_MAX);
  EXPECT_THAT(last_reply().error().message(), testing::HasSubstr("than was given"));
  EXPECT_EQ(ports_.cancelled_queries, std::vector{ports_.queries[0].ticket});
  EXPECT_TRUE(ports_.more.empty());
}

TEST_F(ServiceQueryTest, AnswersOfOthersCanBeNeitherTakenNorEnded) {
  ask(7);
  give(0);
  want_more(7, 1, "another");
  EXPECT_THAT(last_reply().error().message(), testing::HasSubstr("no answer"));
  end(7, "another");
  EXPECT_TRUE(ports_.more.empty());
  EXPECT_TRUE(ports_.cancelled_queries.empty());
}

TEST_F(ServiceQueryTest, AnAnswerThatItsClientEndsIsCancelledWithoutAReply) {
  ask(7);
  give(0);
  end(7);
  EXPECT_EQ(ports_.cancelled_queries, std::vector{ports_.queries[0].ticket});
  give(0);
  EXPECT_EQ(ports_.replies.size(), 1U);
  end(7);
  EXPECT_EQ(ports_.replies.size(), 1U);
}

TEST_F(ServiceQueryTest, NobodyIsToldToWaitWhileHeIsWaitedFor) {
  ask(7);
  for (std::uint64_t i = 0; i < kChunksAhead; ++i) {
    give(0);
  }
  pass(10'000);
  EXPECT_EQ(ports_.replies.size(), kChunksAhead);
  want_more(7, 1);
  pass(1000);
  EXPECT_TRUE(last_reply().has_still_working());
}

TEST_F(ServiceQueryTest, APartThatCannotBeDeliveredCancelsTheQuery) {
  ask(7);
  ports_.unreachable = "client";
  give(0);
  EXPECT_EQ(ports_.cancelled_queries, std::vector{ports_.queries[0].ticket});
}

}  // namespace
}  // namespace oblique::server
