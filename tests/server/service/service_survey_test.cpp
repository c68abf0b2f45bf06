// Studies whose points must be looked at before they are taken: filters, expressions.
#include <algorithm>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

#include "server/service/outbox/request_reader.h"
#include "tests/server/service/service_fixture.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class ServiceSurveyTest : public ServiceTest {
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

TEST_F(ServiceSurveyTest, AFilterIsCountedElsewhereAndTheStudyHasThePointsThatAreLeftIn) {
  request(filtered_request("mu > 0.75"));
  EXPECT_THAT(outbox_.replies, IsEmpty());
  ASSERT_EQ(outbox_.reads.size(), 1U);
  read_all();
  write_all();
  EXPECT_EQ(last_reply().submit().points(), 3U);
  EXPECT_EQ(status_of("filtered").points(), 3U);
}

TEST_F(ServiceSurveyTest, PointsOfAFilteredStudyHaveTracesByTheirNumbers) {
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

TEST_F(ServiceSurveyTest, AChangeOfTheRightNameAndAWrongNumberSaysWhatIsWrong) {
  request(submit_request("a"));
  write_all();
  ClientRequest message = change_request("a", protocol::STUDY_CHANGE_DELETE);
  message.mutable_change()->set_study_id(9);
  request(message);
  EXPECT_THAT(last_reply().error().message(),
              HasSubstr("the study that is called \"a\" is another one"));
}

TEST_F(ServiceSurveyTest, WhatAClientSaysOfCountsDoesNotCount) {
  ClientRequest message = filtered_request("mu > 0.75");
  message.mutable_submit()->mutable_recipe()->mutable_blocks(0)->set_points_left_in(11);
  request(message);
  read_all();
  write_all();
  EXPECT_EQ(last_reply().submit().points(), 3U);
}

TEST_F(ServiceSurveyTest, TheWorkerGetsTheRecipeAndOnlyWhatIsLeftInIsWantedOfIt) {
  request(filtered_request("mu > 0.75"));
  read_all();
  write_all();
  hello();
  credit(1);
  EXPECT_EQ(points_of(last_message().batch()).front(), 8U);
  for (int point = 0; point < 3; ++point) {
    answer_batch(100);
    credit(1);
  }
  EXPECT_EQ(status_of("filtered").state(), "done");
  EXPECT_EQ(status_of("filtered").solved(), 3U);
}

TEST_F(ServiceSurveyTest, AValueThatIsNotAllowedIsAnErrorWithThePoint) {
  ClientRequest message = filtered_request("");
  *message.mutable_submit()->mutable_recipe() = protocol::recipe_of(
      {{protocol::following("k", "1e7 * (0.55 - mu)"), protocol::listed("H", {0.5}),
        protocol::range("mu", 0.0, 1.0, 11), protocol::listed("e", {1.0})}});
  request(message);
  read_all();
  EXPECT_THAT(last_reply().error().message(), HasSubstr("point 6: k = "));
}

TEST_F(ServiceSurveyTest, AFilterThatIsNoneIsRefusedAtOnce) {
  request(filtered_request("mu >"));
  EXPECT_THAT(outbox_.reads, IsEmpty());
  EXPECT_THAT(last_reply().error().message(), HasSubstr("where"));
}

TEST_F(ServiceSurveyTest, WhoWaitsHearsOfItAndWhoIsGoneIsForgotten) {
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

TEST_F(ServiceSurveyTest, OneKeyWithManyConnectionsLeavesRoomForOthers) {
  const auto submit = [&](const std::string& client, const std::string& key) {
    const auto holder = std::make_shared<const KeyHolder>(KeyHolder{key, protocol::Role::kClient});
    service_->client_frame(client, protocol::encode(filtered_request("mu > 0.75")), now_, holder);
  };
  const std::size_t room = ClientsDeskSettings().most_long_requests;
  for (std::size_t i = 0; i < room; ++i) {
    submit("connection " + std::to_string(i), "one");
  }
  EXPECT_EQ(outbox_.reads.size(), room / 4);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("too many long requests"));
  submit("another connection", "other");
  EXPECT_EQ(outbox_.reads.size(), room / 4 + 1);
}

TEST_F(ServiceSurveyTest, TheSameStudySubmittedAgainIsThatStudy) {
  for (int i = 0; i < 2; ++i) {
    request(filtered_request("mu > 0.75"));
    read_all();
    write_all();
  }
  EXPECT_EQ(last_reply().submit().points(), 3U);
  EXPECT_FALSE(last_reply().submit().created());
}

/// Reports of a reader, with a thread of its own.
class Reports {
 public:
  void put(ReadReport report) {
    const std::lock_guard lock(mutex_);
    reports_.push_back(std::move(report));
    came_.notify_all();
  }
  /// The report of that ticket, once it has come.
  ReadReport wait_for(std::uint64_t ticket) {
    std::unique_lock lock(mutex_);
    auto found = reports_.end();
    came_.wait(lock, [&] {
      found = std::find_if(reports_.begin(), reports_.end(),
                           [&](const ReadReport& report) { return report.ticket == ticket; });
      return found != reports_.end();
    });
    return *found;
  }

  std::size_t count() {
    const std::lock_guard lock(mutex_);
    return reports_.size();
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<ReadReport> reports_;
};

/// A request to count a filter over so many points.
std::string frame_of(std::uint64_t points) {
  ClientRequest message;
  message.set_protocol_version(protocol::kProtocolVersion);
  message.mutable_submit()->set_name("many");
  *message.mutable_submit()->mutable_recipe() = protocol::recipe_of_blocks(
      {protocol::filtered({protocol::listed("H", {0.5}), protocol::range("mu", 0.0, 1.0, points),
                           protocol::listed("e", {1.0})},
                          "mu > 0.5")});
  return protocol::encode(message);
}

TEST(RequestReaderSurveyTest, ALongSurveyHoldsUpNoOtherRequest) {
  constexpr std::uint64_t kMinutes = 100'000'000;
  Reports reports;
  RequestReader reader([&](ReadReport report) { reports.put(std::move(report)); });
  reader.submit({1, frame_of(kMinutes)});
  ClientRequest status;
  status.set_protocol_version(protocol::kProtocolVersion);
  status.mutable_status();
  reader.submit({2, protocol::encode(status)});
  EXPECT_TRUE(reports.wait_for(2).read.is_readable);
  reader.submit({3, frame_of(11)});
  EXPECT_EQ(reports.wait_for(3).read.table.size(), 5U);
}

TEST(RequestReaderSurveyTest, ASurveyThatIsCancelledIsNotEnded) {
  constexpr std::uint64_t kPoints = 2'000'001;
  Reports reports;
  RequestReader reader([&](ReadReport report) { reports.put(std::move(report)); });
  // By turns the first of two that take as long would come to its end first.
  reader.submit({1, frame_of(kPoints), {}, 0, "one"});
  reader.cancel(1);
  reader.submit({2, frame_of(kPoints), {}, 0, "other"});
  EXPECT_EQ(reports.wait_for(2).read.table.size(), kPoints / 2);
  EXPECT_EQ(reports.count(), 1U);
}

TEST(RequestReaderSurveyTest, TheLongSurveysOfSomeHoldUpNoSmallOneOfAnother) {
  Reports reports;
  RequestReader reader([&](ReadReport report) { reports.put(std::move(report)); });
  for (const std::uint64_t ticket : {1U, 2U, 3U, 4U}) {
    reader.submit({ticket, frame_of(100'000'000), {}, 0, ticket % 2 == 0 ? "one" : "other"});
  }
  reader.submit({5, frame_of(11), {}, 0, "third"});
  EXPECT_EQ(reports.wait_for(5).read.table.size(), 5U);
  EXPECT_EQ(reports.count(), 1U) << "the others are still at it";
}

TEST(RequestReaderSurveyTest, SurveysThatTakeTurnsCountAsIfTheyHadNone) {
  constexpr std::uint64_t kPoints = 2'000'001;
  Reports reports;
  RequestReader reader([&](ReadReport report) { reports.put(std::move(report)); });
  reader.submit({1, frame_of(kPoints), {}, 0, "one"});
  reader.submit({2, frame_of(kPoints), {}, 0, "other"});
  EXPECT_EQ(reports.wait_for(1).read.table.size(), kPoints / 2);
  EXPECT_EQ(reports.wait_for(2).read.table.size(), kPoints / 2);
}

TEST(RequestReaderSurveyTest, AReaderThatEndsDoesNotWaitForASurvey) {
  Reports reports;
  {
    RequestReader reader([&](ReadReport report) { reports.put(std::move(report)); });
    reader.submit({1, frame_of(100'000'000)});
    reader.submit({2, frame_of(100'000'000)});
  }
  SUCCEED();
}

}  // namespace
}  // namespace oblique::server
