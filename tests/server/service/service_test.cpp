#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

TEST_F(ServiceTest, AStudyIsAcknowledgedOnlyOnceItIsStored) {
  request(submit_request("a"));
  EXPECT_TRUE(ports_.replies.empty());
  write_all();
  const auto reply = last_reply();
  EXPECT_EQ(reply.request_id(), 42U);
  EXPECT_EQ(reply.submit().points(), 10U);
  EXPECT_TRUE(reply.submit().created());
}

TEST_F(ServiceTest, WhileTheDatabaseStoresNothingForSecondsClientsAreToldSo) {
  submit("a");
  const std::size_t replies = ports_.replies.size();
  request(submit_request("b"));
  service_->tick(now_);
  now_.steady_ms += 4999;
  service_->tick(now_);
  request(submit_request("b"));
  EXPECT_EQ(ports_.replies.size(), replies) << "it may be stored in a moment";
  now_.steady_ms += 1;
  service_->tick(now_);
  request(submit_request("b"));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("stored nothing for over 5 s"));
  EXPECT_THAT(status_of("a").waits_for(), HasSubstr("stored nothing for over 5 s"));
  write_all();
  service_->tick(now_);
  EXPECT_EQ(status_of("a").waits_for(), "a worker");
}

TEST_F(ServiceTest, TheStatusOfAStudySaysThatItsWorkersStoreNothing) {
  submit("a", 1);
  hello_and_credit();
  WorkerMessage heartbeat;
  heartbeat.mutable_heartbeat()->add_lease_ids(last_message().batch().lease_id());
  const auto pass = [&](int seconds) {
    for (int second = 0; second < seconds; ++second) {
      now_.steady_ms += 1000;
      worker_says(heartbeat);
      service_->tick(now_);
    }
  };
  pass(19);
  EXPECT_EQ(status_of("a").waits_for(), "");
  pass(1);
  EXPECT_EQ(status_of("a").waits_for(),
            "results of 1 point from 1 worker, which stored nothing for over 20 s");
  pass(60);
  EXPECT_EQ(status_of("a").waits_for(), "a worker") << "one that is not set aside";
}

TEST_F(ServiceTest, AStudyThatCouldNotBeStoredIsRefusedAndItsNameIsFree) {
  request(submit_request("a"));
  write_all("the disk is full");
  EXPECT_THAT(last_reply().error().message(), HasSubstr("the disk is full"));
  submit("a", 20);
  EXPECT_EQ(last_reply().submit().points(), 20U);
}

TEST_F(ServiceTest, TheSameStudyContinuesAndAnotherOfTheNameIsRefused) {
  submit("a");
  request(submit_request("a"));
  EXPECT_FALSE(last_reply().submit().created());
  request(submit_request("a", 11));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("another name"));
}

TEST_F(ServiceTest, BadStudiesAreRefusedWithTheReason) {
  request(submit_request(""));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("1 to 100 bytes"));
  request(submit_request("a\nb"));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("control characters"));
  auto bad = submit_request("a");
  bad.mutable_submit()->mutable_recipe()->mutable_blocks(0)->mutable_axes(2)->set_values(0, 1.5);
  request(bad);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("e = 1.5"));
  bad = submit_request("a");
  bad.mutable_submit()->set_priority(100'000);
  request(bad);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("priority = 100000"));
  bad = submit_request("a");
  bad.mutable_submit()->mutable_recipe()->clear_model();
  request(bad);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("the recipe has no model"));
  EXPECT_TRUE(ports_.jobs.empty());
}

TEST_F(ServiceTest, CancellingIsAcknowledgedOnceItIsStoredAndSubmittingAgainGoesOn) {
  submit("a");
  ports_.replies.clear();
  request(cancel_request("a"));
  EXPECT_TRUE(ports_.replies.empty());
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "cancelled");
  request(cancel_request("a"));
  EXPECT_EQ(last_reply().change().study().state(), "cancelled");
  submit("a");
  EXPECT_FALSE(last_reply().submit().created());
  EXPECT_FALSE(service_->scheduler().study(1).cancelled);
  request(cancel_request("b"));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("no study called \"b\""));
}

TEST_F(ServiceTest, AWorkerIsWelcomedByNumberAndItsHeartbeatsAreAnswered) {
  credit(1);
  EXPECT_TRUE(last_message().has_hello_again()) << "a stranger";
  hello();
  EXPECT_EQ(last_message().welcome().worker_id(), 1U);
  EXPECT_EQ(last_message().welcome().database_id(), "db");
  EXPECT_EQ(last_message().welcome().lost_after_ms(), 2800U);
  WorkerMessage message;
  message.mutable_heartbeat();
  worker_says(message);
  EXPECT_TRUE(last_message().has_heartbeat_reply());
}

TEST_F(ServiceTest, AWorkerThatSaysHelloTwiceBeginsAnew) {
  submit("a");
  hello_and_credit();
  ASSERT_TRUE(last_message().has_batch());
  hello();
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  EXPECT_EQ(service_->scheduler().study(1).leased, 0U);
}

TEST_F(ServiceTest, ResultsAreAcknowledgedOnceTheyAreStored) {
  submit("a", 1);
  hello_and_credit();
  const auto batch = last_message().batch();
  WorkerMessage message;
  auto& results = *message.mutable_results();
  results.set_study_id(batch.study_id());
  results.set_lease_id(batch.lease_id());
  results.set_attempt(batch.attempt());
  results.set_sequence(9);
  results.set_batch_done(true);
  *results.add_results() = solved(0);
  write_all();
  worker_says(message);
  ASSERT_EQ(ports_.jobs.size(), 2U) << "the worker's row and the results";
  EXPECT_FALSE(last_message().has_results_stored());
  write_all();
  EXPECT_EQ(last_message().results_stored().sequence(), 9U);
  // Its end is noted in the database.
  ASSERT_EQ(ports_.jobs.size(), 1U);
  EXPECT_EQ(std::get<SetStudyState>(ports_.jobs[0].change).state, StudyState::kDone);
}

TEST_F(ServiceTest, AResultThatIsNotFiniteOrOfOtherInputsThanItsPointBecomesAFailedPoint) {
  submit("a", 3);
  hello();
  WorkerMessage message;
  message.mutable_results()->set_study_id(1);
  for (std::uint64_t point = 0; point < 3; ++point) {
    *message.mutable_results()->add_results() = solved(point);
  }
  auto& results = *message.mutable_results()->mutable_results();
  results.at(0).set_h_m(std::nextafter(results.at(0).h_m(), 2.0));
  results.at(1).set_h_m(1.001 * results.at(1).h_m());
  results.at(2).set_reals(4, std::numeric_limits<double>::quiet_NaN());
  worker_says(message);
  ASSERT_EQ(ports_.jobs.size(), 2U) << "the worker's row and the results";
  const auto& change = std::get<AddResults>(ports_.jobs[1].change);
  EXPECT_EQ(change.results.at(0).error(), "") << "another machine may round otherwise";
  EXPECT_THAT(change.results.at(1).error(), HasSubstr("H = 1.00"));
  EXPECT_THAT(change.results.at(2).error(), HasSubstr("duration_s"));
  write_all();
  EXPECT_EQ(service_->scheduler().study(1).failed, 2U);
}

TEST_F(ServiceTest, AWorkerThatSolvesOtherPointsThanTheStudyHasIsNotProven) {
  submit("a", 2);
  hello_and_credit();
  WorkerMessage message;
  message.mutable_results()->set_study_id(1);
  message.mutable_results()->set_lease_id(last_message().batch().lease_id());
  auto result = solved(0);
  result.set_h_m(1.001 * result.h_m());
  *message.mutable_results()->add_results() = result;
  worker_says(message);
  EXPECT_FALSE(service_->scheduler().worker(1, now_.steady_ms).is_proven);
  *message.mutable_results()->mutable_results(0) = solved(0);
  worker_says(message);
  EXPECT_TRUE(service_->scheduler().worker(1, now_.steady_ms).is_proven);
}

TEST_F(ServiceTest, WhatIsNoMessageIsCountedAndClientsAreTold) {
  service_->worker_frame("worker", "\xff\xff", now_);
  service_->worker_frame("worker", "", now_);
  EXPECT_EQ(service_->bad_frames(), 2U);
  EXPECT_TRUE(ports_.worker_messages.empty());
  service_->client_frame("client", "\xff\xff", now_);
  EXPECT_TRUE(last_reply().has_error());
  ClientRequest nothing = client_request();
  request(nothing);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("kind of request"));
  nothing.set_protocol_version(protocol::kProtocolVersion + 1);
  request(nothing);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("protocol version"));
}

TEST_F(ServiceTest, NoFloodOfBadFramesFloodsTheLog) {
  for (int i = 0; i < 1000; ++i) {
    service_->worker_frame("worker", "\xff", now_);
  }
  EXPECT_LE(ports_.lines.size(), 10);
}

TEST_F(ServiceTest, TooManyQueriesAreRefused) {
  ClientRequest message = client_request();
  message.mutable_query()->set_sql("SELECT 1");
  for (std::uint64_t id = 1; id <= 2; ++id) {
    message.set_request_id(id);
    request(message);
  }
  EXPECT_TRUE(ports_.replies.empty());
  message.set_request_id(3);
  request(message);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("too many queries"));
  EXPECT_EQ(last_reply().request_id(), 3U);
  answer_query(0, encoded_error("no such column"));
  EXPECT_EQ(last_reply().error().message(), "no such column");
  EXPECT_EQ(last_reply().request_id(), 1U);
}

TEST_F(ServiceTest, StatusTellsTheRateOfTheLastSeconds) {
  submit("a", 1000);
  hello();
  WorkerMessage message;
  message.mutable_results()->set_study_id(1);
  for (std::uint64_t point = 0; point < 100; ++point) {
    *message.mutable_results()->add_results() = solved(point);
  }
  service_->tick(now_);
  worker_says(message);
  write_all();
  now_.steady_ms += 500;
  const auto status = status_of("a");
  EXPECT_EQ(status.solved(), 100U);
  EXPECT_DOUBLE_EQ(status.points_per_s(), 200.0);
  EXPECT_EQ(status.created_at(), "2023-11-14T22:13:20.123Z");
}

TEST_F(ServiceTest, AServerThatStopsTellsItsWorkersAndHandsOutNothing) {
  submit("a");
  hello();
  service_->stop(now_);
  EXPECT_TRUE(last_message().has_stopping());
  const auto before = ports_.worker_messages.size();
  credit(1);
  EXPECT_EQ(ports_.worker_messages.size(), before);
  request(submit_request("b"));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("stopping"));
}

}  // namespace
}  // namespace oblique::server
