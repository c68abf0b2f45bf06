// Jobs of the pool that makes the page's answers, with a service that the test plays.
#include "server/web/answers/answer_pool.h"

#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "proto/wire/chunk.h"
#include "server/web/answers/study_answers.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using protocol::ClientReply;
using protocol::ClientRequest;
using testing::ElementsAre;

class AnswerPoolTest : public testing::Test {
 protected:
  /// The next request of a job.
  ClientRequest requested() {
    while (requests_.empty()) {
      for (const std::string& frame : line_.take()) {
        EXPECT_TRUE(protocol::decode(frame, requests_.emplace_back()));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ClientRequest first = requests_.front();
    requests_.erase(requests_.begin());
    return first;
  }
  void reply(const ClientRequest& to, ClientReply reply) {
    reply.set_request_id(to.request_id());
    line_.put(protocol::encode(reply));
  }
  HttpAnswer answer(std::uint64_t number) {
    std::optional<HttpAnswer> answer;
    while (!(answer = pool_.take(number))) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return *answer;
  }
  static AnswerPool::Job query_job() {
    return [](const JobContext& context) {
      std::string points;
      context.query({}, [&](const protocol::ChunkRows& row) {
        points += std::to_string(row.cell(0).integer) + ' ';
      });
      return HttpAnswer{200, {}, points};
    };
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

  ServiceLine line_;
  std::vector<ClientRequest> requests_;
  AnswerPool pool_{line_, [] {}, std::chrono::hours(1)};
};

TEST_F(AnswerPoolTest, AJobReadsAllChunksOfAQuery) {
  ASSERT_TRUE(pool_.submit(7, query_job()));
  const ClientRequest query = requested();
  reply(query, chunk_of({1, 2}, false));
  const ClientRequest more = requested();
  EXPECT_EQ(more.more_rows().request_id(), query.request_id());
  EXPECT_EQ(more.more_rows().taken(), 1U);
  reply(query, chunk_of({5}, true));
  EXPECT_EQ(answer(7).body, "1 2 5 ");
}

TEST_F(AnswerPoolTest, TheQueryOfAClientThatHasGoneEnds) {
  ASSERT_TRUE(pool_.submit(7, query_job()));
  const ClientRequest query = requested();
  pool_.forget(7);
  EXPECT_EQ(requested().end_query().request_id(), query.request_id());
}

TEST_F(AnswerPoolTest, AJobThatIsTooSlowEndsItsQueryAndSaysSo) {
  AnswerPool hasty(
      line_, [] {}, std::chrono::milliseconds(0));
  ASSERT_TRUE(hasty.submit(7, [&](const JobContext& context) {
    EXPECT_TRUE(context.is_over());
    return query_job()(context);
  }));
  std::optional<HttpAnswer> late;
  while (!(late = hasty.take(7))) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(late->status, 503U);
  const ClientRequest query = requested();
  EXPECT_EQ(requested().end_query().request_id(), query.request_id());
}

TEST_F(AnswerPoolTest, OfAStudyWithoutFailuresNoneIsLookedFor) {
  ASSERT_TRUE(pool_.submit(7, study_job(1)));
  ClientReply status;
  status.mutable_status()->add_studies()->set_study_id(1);
  reply(requested(), status);
  ClientReply described;
  *described.mutable_describe()->mutable_recipe() = protocol::recipe_of(
      {{protocol::listed("H", {1}), protocol::listed("mu", {1}), protocol::listed("e", {1})}});
  reply(requested(), described);
  std::optional<HttpAnswer> found;
  while (!(found = pool_.take(7))) {
    ASSERT_TRUE(line_.take().empty()) << "another request";
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(found->status, 200U);
}

TEST_F(AnswerPoolTest, AnErrorOfTheServiceIsTheAnswer) {
  ASSERT_TRUE(pool_.submit(7, query_job()));
  ClientReply wrong;
  wrong.mutable_error()->set_message("no such column");
  wrong.mutable_error()->set_wrong_request(true);
  reply(requested(), wrong);
  EXPECT_EQ(answer(7).status, 400U);
}

}  // namespace
}  // namespace oblique::server
