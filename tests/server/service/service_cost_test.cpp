// What costly but valid messages cost, counted in work and not in time.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/wire/frame_scan.h"
#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

/// A submission whose recipe has so many bytes at least.
ClientRequest long_submission(const std::string& name, std::size_t bytes) {
  ClientRequest message = client_request(7);
  message.mutable_submit()->set_name(name);
  auto& mu = *message.mutable_submit()->mutable_recipe();
  mu = protocol::recipe_of(
      {{protocol::listed("H", {1.0}), protocol::listed("mu", {}), protocol::listed("e", {1.0})}});
  for (std::size_t i = 0; i < bytes / 8 + 1; ++i) {
    mu.mutable_blocks(0)->mutable_axes(1)->add_values(0.1 + 1e-9 * static_cast<double>(i));
  }
  return message;
}

constexpr std::size_t kLong = std::size_t{100} * 1024;

TEST_F(ServiceTest, ALongRecipeIsJudgedElsewhereAndOthersAreAnsweredMeanwhile) {
  request(long_submission("large", kLong));
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

TEST_F(ServiceTest, OfTwoLongSubmissionsOfOneNameTheSameIsOneStudyAndAnotherIsRefused) {
  request(long_submission("a", kLong));
  service_->client_frame("same", protocol::encode(long_submission("a", kLong)), now_);
  service_->client_frame("other", protocol::encode(long_submission("a", 2 * kLong)), now_);
  run_checks();
  write_all();
  ASSERT_EQ(ports_.replies.size(), 3U);
  EXPECT_TRUE(ports_.replies[0].submit().created());
  EXPECT_FALSE(ports_.replies[1].submit().created());
  EXPECT_EQ(ports_.replies[0].submit().study_id(), ports_.replies[1].submit().study_id());
  EXPECT_THAT(ports_.replies[2].error().message(), HasSubstr("another name"));
}

TEST_F(ServiceTest, ALongRecipeWithAFaultIsRefusedWithTheReason) {
  ClientRequest bad = long_submission("a", kLong);
  bad.mutable_submit()->mutable_recipe()->mutable_blocks(0)->mutable_axes(2)->set_values(0, 1.5);
  request(bad);
  run_checks();
  EXPECT_EQ(last_reply().request_id(), 7U);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("e = 1.5"));
  EXPECT_TRUE(ports_.jobs.empty());
}

TEST_F(ServiceTest, LongRequestsThatWaitAreBoundedForEachClientAndInAll) {
  ClientRequest message = long_submission("a", kLong);
  for (std::uint64_t id = 1; id <= 3; ++id) {
    message.set_request_id(id);
    request(message);
  }
  EXPECT_EQ(ports_.checks.size(), 2U);
  EXPECT_EQ(last_reply().request_id(), 3U);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("ask again later"));
  const std::string frame = protocol::encode(long_submission("a", std::size_t{10} << 20U));
  for (int i = 0; i < 12; ++i) {
    service_->client_frame("client " + std::to_string(i), frame, now_);
  }
  EXPECT_EQ(ports_.checks.size() - 2, (std::size_t{64} << 20U) / frame.size());
  run_checks();
  request(message);
  EXPECT_EQ(ports_.checks.size(), 1U) << "there is room again";
}

TEST_F(ServiceTest, ALongRequestThatIsSentAgainWhileItWaitsIsReadAndAnsweredOnce) {
  for (int i = 0; i < 5; ++i) {
    request(long_submission("a", kLong));
  }
  EXPECT_EQ(ports_.checks.size(), 1U);
  EXPECT_TRUE(ports_.replies.empty());
  run_checks();
  write_all();
  EXPECT_EQ(ports_.replies.size(), 1U);
}

TEST_F(ServiceTest, ALongRequestThatComesOrWaitsWhileTheServerStopsIsAnswered) {
  request(long_submission("a", kLong));
  service_->stop(now_);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("stopping"));
  request(long_submission("b", kLong));
  EXPECT_EQ(ports_.replies.size(), 2U);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("stopping"));
  run_checks();
  EXPECT_EQ(ports_.replies.size(), 2U) << "each is answered once";
  EXPECT_TRUE(ports_.jobs.empty());
}

TEST_F(ServiceTest, ALongFrameThatIsNoMessageIsAnsweredWithItsNumber) {
  std::string frame = protocol::encode(long_submission("a", kLong));
  frame.back() = '\x7f';
  frame += '\x7f';
  service_->client_frame("client", frame, now_);
  run_checks();
  EXPECT_EQ(last_reply().request_id(), 7U);
  EXPECT_TRUE(last_reply().has_error());
  EXPECT_EQ(service_->bad_frames(), 1U);
}

TEST_F(ServiceTest, MessagesThatAreLongerThanThoseOfWorkersAreBadFramesThatAreNotParsed) {
  WorkerMessage heartbeat;
  for (std::uint64_t i = 0; i <= protocol::kMostLeasesAHeartbeat; ++i) {
    heartbeat.mutable_heartbeat()->add_lease_ids(i);
  }
  WorkerMessage results;
  for (std::size_t i = 0; i <= protocol::kMostResultsAMessage; ++i) {
    results.mutable_results()->add_results();
  }
  worker_says(heartbeat);
  EXPECT_EQ(service_->bad_frames(), 1U) << "a stranger's";
  for (const WorkerMessage& message : {heartbeat, results}) {
    hello();
    worker_says(message);
    EXPECT_TRUE(last_message().has_hello_again());
    EXPECT_EQ(service_->scheduler().workers(), 0U);
  }
  EXPECT_EQ(service_->bad_frames(), 3U);
  EXPECT_TRUE(ports_.jobs.empty());
}

TEST_F(ServiceTest, AWorkerThatDeliversNothingLeavesNoRowAndOneThatDoesHasItFirst) {
  submit("a", 4);
  for (int i = 0; i < 1000; ++i) {
    hello("worker " + std::to_string(i));
  }
  EXPECT_TRUE(ports_.jobs.empty());
  hello_and_credit();
  const auto batch = last_message().batch();
  WorkerMessage message;
  auto& results = *message.mutable_results();
  results.set_study_id(batch.study_id());
  results.set_lease_id(batch.lease_id());
  for (int sequence = 1; sequence <= 2; ++sequence) {
    results.set_sequence(static_cast<std::uint64_t>(sequence));
    results.clear_results();
    *results.add_results() = solved(points_of(batch).front());
    worker_says(message);
  }
  ASSERT_EQ(ports_.jobs.size(), 3U) << "one row of the worker, and two messages";
  EXPECT_EQ(std::get<AddWorker>(ports_.jobs[0].change).worker_id, 1001U);
  EXPECT_EQ(std::get<AddResults>(ports_.jobs[1].change).worker_id, 1001U);
}

TEST_F(ServiceTest, WorkersThatComeAndGoWithoutEndDoNotFillTheLog) {
  WorkerMessage goodbye;
  goodbye.mutable_goodbye();
  for (int i = 0; i < 10'000; ++i) {
    hello("worker " + std::to_string(i));
    worker_says(goodbye, "worker " + std::to_string(i));
  }
  EXPECT_EQ(ports_.lines.size(), 20U);
  ports_.lines.clear();
  now_.steady_ms += 20'000;
  hello();
  ASSERT_EQ(ports_.lines.size(), 2U);
  EXPECT_THAT(ports_.lines[0], HasSubstr("and 19980 more lines"));
  EXPECT_THAT(ports_.lines[1], HasSubstr("joins"));
}

TEST_F(ServiceTest, StudiesComeInPagesThatHoldEachOnce) {
  constexpr int kStudies = 2500;
  for (int i = 0; i < kStudies; ++i) {
    service_->client_frame("client", protocol::encode(submit_request(std::to_string(i))), now_);
  }
  write_all();
  std::uint64_t after = 0;
  int seen = 0;
  for (const int size : {1000, 1000, 500}) {
    const auto page = statuses(after);
    ASSERT_EQ(page.studies_size(), size);
    for (const auto& study : page.studies()) {
      EXPECT_GT(study.study_id(), after);
      after = study.study_id();
    }
    seen += size;
    EXPECT_EQ(page.next_after(), seen < kStudies ? after : 0U);
  }
  EXPECT_EQ(statuses(0, 10).studies_size(), 10);
  EXPECT_EQ(statuses(0, 1'000'000).studies_size(), 1000);
}

TEST_F(ServiceTest, WorkersComeInPagesToo) {
  for (int i = 0; i < 1500; ++i) {
    hello("worker " + std::to_string(i));
  }
  const auto page = workers();
  ASSERT_EQ(page.workers_size(), 1000);
  EXPECT_EQ(workers(page.next_after()).workers_size(), 500);
  EXPECT_EQ(last_reply().workers().next_after(), 0U);
}

}  // namespace
}  // namespace oblique::server
