// Studies with filters and expressions: some of their points are judged before they are taken.
#include <cstdint>
#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/service/outbox/request_reader.h"
#include "server/study/limits.h"
#include "tests/server/service/service_fixture.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class FilteredStudyTest : public ServiceTest {
 protected:
  /// mu = 0, 0.1, ..., 1.
  ClientRequest filtered_request(const std::string& where) {
    ClientRequest message = submit_request("filtered");
    *message.mutable_submit()->mutable_recipe() = protocol::recipe_of_blocks(
        {protocol::filtered({protocol::listed("H", {0.5}), protocol::range("mu", 0.0, 1.0, 11),
                             protocol::listed("e", {1.0})},
                            where)});
    return message;
  }
};

TEST_F(FilteredStudyTest, PointsAreJudgedElsewhereAndTheStudyHasAllOfThem) {
  request(filtered_request("mu > 0.75"));
  EXPECT_THAT(outbox_.replies, IsEmpty());
  ASSERT_EQ(outbox_.reads.size(), 1U);
  read_all();
  write_all();
  EXPECT_EQ(last_reply().submit().points(), 11U);
  EXPECT_EQ(status_of("filtered").points(), 11U);
  EXPECT_EQ(status_of("filtered").left_out(), 0U) << "no worker has named any";
}

TEST_F(FilteredStudyTest, PointsOfAFilteredStudyHaveTracesByTheirNumbers) {
  request(filtered_request("mu > 0.75"));
  read_all();
  write_all();
  hello();
  const auto ask = [&](std::uint64_t point) {
    outbox_.replies.clear();
    ClientRequest message;
    message.set_protocol_version(protocol::kProtocolVersion);
    message.set_request_id(7);
    message.mutable_trace()->set_study("filtered");
    message.mutable_trace()->set_point(point);
    message.mutable_trace()->set_only_point(true);
    request(message);
    return last_reply();
  };
  EXPECT_NEAR(ask(9).trace().mu(), 0.9, 1e-12);
  EXPECT_THAT(ask(3).error().message(), HasSubstr("point 3 is left out by the study's filter"));
  EXPECT_THAT(ask(11).error().message(), HasSubstr("its points are 0 to 10"));
}

TEST_F(FilteredStudyTest, AChangeOfTheRightNameAndAWrongNumberSaysWhatIsWrong) {
  request(submit_request("a"));
  write_all();
  ClientRequest message = change_request("a", protocol::STUDY_CHANGE_DELETE);
  message.mutable_change()->set_study_id(9);
  request(message);
  EXPECT_THAT(last_reply().error().message(),
              HasSubstr("the study that is called \"a\" is another one"));
}

TEST_F(FilteredStudyTest, TheWorkerNamesWhatIsLeftOutAndTheRestIsSolved) {
  request(filtered_request("mu > 0.75"));
  read_all();
  write_all();
  hello();
  credit(1);
  while (last_message().has_batch()) {
    answer_batch(100);
    credit(1);
  }
  const auto status = status_of("filtered");
  EXPECT_EQ(status.state(), "done");
  EXPECT_EQ(status.solved(), 3U);
  EXPECT_EQ(status.left_out(), 8U);
}

TEST_F(FilteredStudyTest, RangesThatAreNoneEndTheConnectionOfTheirWorker) {
  request(filtered_request("mu > 0.75"));
  read_all();
  write_all();
  // After three lost workers the next one gets a probe: the first two are of its batch.
  const std::vector<std::vector<std::uint64_t>> wrong{
      {0, 12}, {11, 1}, {0}, {0, 0}, {3, ~std::uint64_t{0}}, {~std::uint64_t{0}, 2}, {0, 1, 5}};
  for (const auto& numbers : wrong) {
    hello();
    credit(1);
    ASSERT_TRUE(last_message().has_batch());
    WorkerMessage message;
    auto& results = *message.mutable_results();
    results.set_study_id(1);
    results.set_lease_id(last_message().batch().lease_id());
    results.set_batch_done(true);
    results.mutable_left_out()->Assign(numbers.begin(), numbers.end());
    worker_says(message);
    write_all();
    EXPECT_EQ(service_->scheduler().workers(), 0U);
    EXPECT_EQ(status_of("filtered").left_out(), 0U);
  }
}

TEST_F(FilteredStudyTest, AValueThatIsNotAllowedIsAnErrorWithThePoint) {
  ClientRequest message = filtered_request("");
  *message.mutable_submit()->mutable_recipe() = protocol::recipe_of(
      {{protocol::following("k", "1e7 * (0.55 - mu)"), protocol::listed("H", {0.5}),
        protocol::range("mu", 0.0, 1.0, 11), protocol::listed("e", {1.0})}});
  request(message);
  read_all();
  EXPECT_THAT(last_reply().error().message(), HasSubstr("point 6: k = "));
}

TEST_F(FilteredStudyTest, AFilterThatIsNoneIsRefusedAtOnce) {
  request(filtered_request("mu >"));
  EXPECT_THAT(outbox_.reads, IsEmpty());
  EXPECT_THAT(last_reply().error().message(), HasSubstr("where"));
}

TEST_F(FilteredStudyTest, WhoWaitsHearsOfItAndWhoIsGoneIsForgotten) {
  request(filtered_request("mu > 0.75"));
  now_.steady_ms += 1500;
  service_->tick(now_);
  EXPECT_EQ(last_reply().still_working().request_id(), 42U);
  service_->client_left("client");
  outbox_.replies.clear();
  now_.steady_ms += 1500;
  service_->tick(now_);
  read_all();
  EXPECT_THAT(outbox_.replies, IsEmpty());
  EXPECT_THAT(outbox_.jobs, IsEmpty());
}

TEST_F(FilteredStudyTest, OneConnectionLeavesRoomForOthers) {
  const auto submit = [&](const std::string& client, std::uint64_t id) {
    ClientRequest message = filtered_request("mu > 0.75");
    message.set_request_id(id);
    service_->client_frame(client, protocol::encode(message), now_);
  };
  for (std::uint64_t id = 1; id <= limits::kLongRequestsOfConnection + 1; ++id) {
    submit("one", id);
  }
  EXPECT_EQ(outbox_.reads.size(), limits::kLongRequestsOfConnection);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("too many long requests"));
  submit("another", 1);
  EXPECT_EQ(outbox_.reads.size(), limits::kLongRequestsOfConnection + 1);
}

TEST_F(FilteredStudyTest, TheSameStudySubmittedAgainIsThatStudy) {
  for (int i = 0; i < 2; ++i) {
    request(filtered_request("mu > 0.75"));
    read_all();
    write_all();
  }
  EXPECT_EQ(last_reply().submit().points(), 11U);
  EXPECT_FALSE(last_reply().submit().created());
}

}  // namespace
}  // namespace oblique::server
