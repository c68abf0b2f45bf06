#include "server/service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "tests/server/results.h"
#include "tests/server/scheduler_bench.h"

namespace oblique::server {
namespace {

using protocol::ClientReply;
using protocol::ClientRequest;
using protocol::ServerToWorker;
using protocol::WorkerMessage;
using testing::HasSubstr;

/// Keeps what the service sends, and writes only when told to.
class FakeOutbox final : public Outbox {
 public:
  bool to_worker(const std::string& identity, const ServerToWorker& message) override {
    if (identity == unreachable) {
      return false;
    }
    worker_messages.push_back(message);
    return true;
  }
  void to_client(const std::string&, const ClientReply& reply) override {
    replies.push_back(reply);
  }
  void write(WriteJob job) override { jobs.push_back(std::move(job)); }
  bool query(QueryJob job) override {
    queries.push_back(std::move(job));
    return queries.size() < 3;
  }
  void note(Severity, const std::string&) override { ++notes; }

  std::string unreachable;
  std::vector<ServerToWorker> worker_messages;
  std::vector<ClientReply> replies;
  std::vector<WriteJob> jobs;
  std::vector<QueryJob> queries;
  int notes = 0;
};

class ServiceTest : public testing::Test {
 protected:
  ServiceTest() {
    ServiceSettings settings;
    settings.solver_version = "1.0";
    settings.database_id = "db";
    service_.emplace(settings, outbox_, std::vector<StoredStudy>{}, now_);
  }

  void request(const ClientRequest& message) {
    service_->client_frame("client", protocol::encode(message), now_);
    service_->scheduler().check_invariants();
  }
  ClientRequest submit_request(const std::string& name, std::uint64_t points = 10) {
    ClientRequest message;
    message.set_protocol_version(protocol::kProtocolVersion);
    message.set_request_id(42);
    message.mutable_submit()->set_name(name);
    *message.mutable_submit()->mutable_recipe() = table_of(points)->recipe();
    return message;
  }
  ClientRequest change_request(const std::string& name, protocol::StudyChange change) {
    ClientRequest message;
    message.set_protocol_version(protocol::kProtocolVersion);
    message.mutable_change()->set_study(name);
    message.mutable_change()->set_change(change);
    return message;
  }
  ClientRequest cancel_request(const std::string& name) {
    return change_request(name, protocol::STUDY_CHANGE_CANCEL);
  }
  /// Results of the points of the last batch, failed ones from `first_failed` on.
  void answer_batch(std::uint64_t first_failed) {
    const auto batch = last_message().batch();
    WorkerMessage message;
    auto& results = *message.mutable_results();
    results.set_study_id(batch.study_id());
    results.set_lease_id(batch.lease_id());
    results.set_sequence(++sequence_);
    results.set_batch_done(true);
    for (std::uint64_t i = batch.first_point(); i < batch.first_point() + batch.count(); ++i) {
      *results.add_results() =
          i < first_failed ? solved_point(i) : protocol::failed_point(i, "for the test");
    }
    worker_says(message);
    write_all();
  }
  void worker_says(const WorkerMessage& message, const std::string& identity = "worker") {
    service_->worker_frame(identity, protocol::encode(message), now_);
    service_->scheduler().check_invariants();
  }
  void hello(const std::string& identity = "worker", const std::string& solver = "1.0") {
    WorkerMessage message;
    message.mutable_hello()->set_protocol_version(protocol::kProtocolVersion);
    message.mutable_hello()->set_solver_version(solver);
    message.mutable_hello()->set_threads(1);
    worker_says(message, identity);
  }
  void credit(std::uint32_t batches) {
    WorkerMessage message;
    message.mutable_credit()->set_batches(batches);
    worker_says(message);
  }
  /// All that waits is written, and fails with `error` unless that is empty.
  void write_all(const std::string& error = {}) {
    for (const WriteJob& job : std::exchange(outbox_.jobs, {})) {
      const bool refused = !error.empty() && job.answer_failure;
      service_->written(
          {refused ? WriteReport::Kind::kRefused : WriteReport::Kind::kStored, job.ticket, error},
          now_);
    }
    service_->scheduler().check_invariants();
  }
  ClientReply last_reply() {
    EXPECT_FALSE(outbox_.replies.empty());
    return outbox_.replies.empty() ? ClientReply() : outbox_.replies.back();
  }
  ServerToWorker last_message() {
    EXPECT_FALSE(outbox_.worker_messages.empty());
    return outbox_.worker_messages.empty() ? ServerToWorker() : outbox_.worker_messages.back();
  }

  std::uint64_t sequence_ = 0;
  Instant now_{1000, 1'700'000'000'123};
  FakeOutbox outbox_;
  std::optional<Service> service_;
};

TEST_F(ServiceTest, AStudyIsAcknowledgedOnlyOnceItIsStored) {
  request(submit_request("a"));
  EXPECT_TRUE(outbox_.replies.empty());
  write_all();
  const auto reply = last_reply();
  EXPECT_EQ(reply.request_id(), 42U);
  EXPECT_EQ(reply.submit().points(), 10U);
  EXPECT_TRUE(reply.submit().created());
}

TEST_F(ServiceTest, AStudyThatCouldNotBeStoredIsRefusedAndItsNameIsFree) {
  request(submit_request("a"));
  write_all("the disk is full");
  EXPECT_THAT(last_reply().error().message(), HasSubstr("the disk is full"));
  request(submit_request("a", 20));
  write_all();
  EXPECT_EQ(last_reply().submit().points(), 20U);
}

TEST_F(ServiceTest, TheSameStudyContinuesAndAnotherOfTheNameIsRefused) {
  request(submit_request("a"));
  write_all();
  request(submit_request("a"));
  EXPECT_FALSE(last_reply().submit().created());
  request(submit_request("a", 11));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("another name"));
}

TEST_F(ServiceTest, TwoWhoSubmitTheSameBeforeItIsStoredAreBothAnswered) {
  request(submit_request("a"));
  request(submit_request("a"));
  write_all();
  ASSERT_EQ(outbox_.replies.size(), 2U);
  EXPECT_TRUE(outbox_.replies[0].submit().created());
  EXPECT_FALSE(outbox_.replies[1].submit().created());
}

TEST_F(ServiceTest, BadStudiesAreRefusedWithTheReason) {
  request(submit_request(""));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("needs a name"));
  request(submit_request("a\nb"));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("control characters"));
  auto bad = submit_request("a");
  bad.mutable_submit()->mutable_recipe()->mutable_blocks(0)->mutable_axes(2)->set_values(0, 1.5);
  request(bad);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("e = 1.5"));
  EXPECT_TRUE(outbox_.jobs.empty());
}

TEST_F(ServiceTest, CancellingIsAcknowledgedOnceItIsStoredAndSubmittingAgainGoesOn) {
  request(submit_request("a"));
  write_all();
  outbox_.replies.clear();
  request(cancel_request("a"));
  EXPECT_TRUE(outbox_.replies.empty());
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "cancelled");
  request(cancel_request("a"));
  EXPECT_EQ(last_reply().change().study().state(), "cancelled");
  request(submit_request("a"));
  write_all();
  EXPECT_FALSE(last_reply().submit().created());
  EXPECT_FALSE(service_->scheduler().study(1).cancelled);
  request(cancel_request("b"));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("no study called \"b\""));
}

TEST_F(ServiceTest, ACancellationThatCouldNotBeStoredLeavesTheStudyRunning) {
  request(submit_request("a"));
  write_all();
  request(cancel_request("a"));
  write_all("the disk is full");
  EXPECT_THAT(last_reply().error().message(), HasSubstr("the disk is full"));
  EXPECT_FALSE(service_->scheduler().study(1).cancelled);
}

TEST_F(ServiceTest, AWorkerIsWelcomedByNumberAndToldTheDatabase) {
  hello();
  EXPECT_EQ(last_message().welcome().worker_id(), 1U);
  EXPECT_EQ(last_message().welcome().database_id(), "db");
  EXPECT_EQ(last_message().welcome().lost_after_ms(), 3000U);
}

TEST_F(ServiceTest, AWorkerOfAnotherVersionIsRefusedWithBothVersions) {
  hello("worker", "0.9");
  EXPECT_THAT(last_message().refused().reason(), HasSubstr("0.9"));
  EXPECT_THAT(last_message().refused().reason(), HasSubstr("1.0"));
  WorkerMessage message;
  message.mutable_hello()->set_protocol_version(77);
  worker_says(message);
  EXPECT_THAT(last_message().refused().reason(), HasSubstr("77"));
  EXPECT_EQ(service_->scheduler().workers(), 0U);
}

TEST_F(ServiceTest, AnUnknownWorkerIsAskedToSayHelloAgain) {
  credit(1);
  EXPECT_TRUE(last_message().has_hello_again());
}

TEST_F(ServiceTest, AHeartbeatIsAnswered) {
  hello();
  WorkerMessage message;
  message.mutable_heartbeat();
  worker_says(message);
  EXPECT_TRUE(last_message().has_heartbeat_reply());
}

TEST_F(ServiceTest, AWorkerThatSaysHelloTwiceBeginsAnew) {
  request(submit_request("a"));
  write_all();
  hello();
  credit(1);
  ASSERT_TRUE(last_message().has_batch());
  hello();
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  EXPECT_EQ(service_->scheduler().study(1).leased, 0U);
}

TEST_F(ServiceTest, ResultsAreAcknowledgedOnceTheyAreStored) {
  request(submit_request("a", 1));
  write_all();
  hello();
  credit(1);
  const auto batch = last_message().batch();
  WorkerMessage message;
  auto& results = *message.mutable_results();
  results.set_study_id(batch.study_id());
  results.set_lease_id(batch.lease_id());
  results.set_attempt(batch.attempt());
  results.set_sequence(9);
  results.set_batch_done(true);
  *results.add_results() = solved_point(0);
  write_all();
  worker_says(message);
  ASSERT_EQ(outbox_.jobs.size(), 1U);
  EXPECT_FALSE(last_message().has_results_stored());
  write_all();
  EXPECT_EQ(last_message().results_stored().sequence(), 9U);
  // Its end is noted in the database.
  ASSERT_EQ(outbox_.jobs.size(), 1U);
  EXPECT_EQ(std::get<SetStudyState>(outbox_.jobs[0].change).state, StudyState::kDone);
}

TEST_F(ServiceTest, AResultThatIsNotFiniteBecomesAFailedPoint) {
  request(submit_request("a", 1));
  write_all();
  hello();
  WorkerMessage message;
  message.mutable_results()->set_study_id(1);
  auto result = solved_point(0);
  result.set_duration_s(std::numeric_limits<double>::quiet_NaN());
  *message.mutable_results()->add_results() = result;
  write_all();
  worker_says(message);
  ASSERT_EQ(outbox_.jobs.size(), 1U);
  const auto& change = std::get<AddResults>(outbox_.jobs[0].change);
  EXPECT_THAT(change.results.at(0).error(), HasSubstr("duration_s"));
}

TEST_F(ServiceTest, AWorkerThatCannotBeReachedLosesItsBatchAtOnce) {
  request(submit_request("a"));
  write_all();
  hello();
  outbox_.unreachable = "worker";
  credit(1);
  EXPECT_EQ(service_->scheduler().workers(), 0U);
  EXPECT_EQ(service_->scheduler().study(1).leased, 0U);
}

TEST_F(ServiceTest, WhatIsNoMessageIsCountedAndClientsAreTold) {
  service_->worker_frame("worker", "\xff\xff", now_);
  service_->worker_frame("worker", "", now_);
  EXPECT_EQ(service_->bad_frames(), 2U);
  EXPECT_TRUE(outbox_.worker_messages.empty());
  service_->client_frame("client", "\xff\xff", now_);
  EXPECT_TRUE(last_reply().has_error());
  ClientRequest nothing;
  nothing.set_protocol_version(protocol::kProtocolVersion);
  request(nothing);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("kind of request"));
  nothing.set_protocol_version(3);
  request(nothing);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("protocol version"));
}

TEST_F(ServiceTest, NoFloodOfBadFramesFloodsTheLog) {
  for (int i = 0; i < 1000; ++i) {
    service_->worker_frame("worker", "\xff", now_);
  }
  EXPECT_LE(outbox_.notes, 10);
}

TEST_F(ServiceTest, TooManyQueriesAreRefused) {
  ClientRequest message;
  message.set_protocol_version(protocol::kProtocolVersion);
  message.mutable_query()->set_sql("SELECT 1");
  request(message);
  request(message);
  EXPECT_TRUE(outbox_.replies.empty());
  request(message);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("too many queries"));
  service_->queried({outbox_.queries[0].ticket, {}, "no such column"});
  EXPECT_EQ(last_reply().error().message(), "no such column");
}

TEST_F(ServiceTest, StatusTellsTheRateOfTheLastSeconds) {
  request(submit_request("a", 1000));
  write_all();
  hello();
  WorkerMessage message;
  message.mutable_results()->set_study_id(1);
  for (std::uint64_t point = 0; point < 100; ++point) {
    *message.mutable_results()->add_results() = solved_point(point);
  }
  service_->tick(now_);
  worker_says(message);
  write_all();
  now_.steady_ms += 500;
  ClientRequest status;
  status.set_protocol_version(protocol::kProtocolVersion);
  status.mutable_status()->set_study("a");
  request(status);
  ASSERT_EQ(last_reply().status().studies_size(), 1);
  EXPECT_EQ(last_reply().status().studies(0).solved(), 100U);
  EXPECT_DOUBLE_EQ(last_reply().status().studies(0).points_per_s(), 200.0);
  EXPECT_EQ(last_reply().status().studies(0).created_at(), "2023-11-14T22:13:20.123Z");
}

TEST_F(ServiceTest, AServerThatStopsTellsItsWorkersAndHandsOutNothing) {
  request(submit_request("a"));
  write_all();
  hello();
  service_->stop(now_);
  EXPECT_TRUE(last_message().has_stopping());
  const auto before = outbox_.worker_messages.size();
  credit(1);
  EXPECT_EQ(outbox_.worker_messages.size(), before);
  request(submit_request("b"));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("stopping"));
}

TEST_F(ServiceTest, AShortenedTextKeepsWholeCharacters) {
  EXPECT_EQ(shortened("a\xc3\xa9", 2), "a");
  EXPECT_EQ(shortened("a\xc3\xa9", 3), "a\xc3\xa9");
}

TEST_F(ServiceTest, APausedStudyHandsOutNothingUntilItIsResumed) {
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  EXPECT_FALSE(last_reply().has_change()) << "not durable yet";
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "paused");
  hello();
  credit(1);
  EXPECT_FALSE(last_message().has_batch());
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "running");
  EXPECT_TRUE(last_message().has_batch());
}

TEST_F(ServiceTest, PointsHandedOutBeforeAPauseAreStillTaken) {
  request(submit_request("a", 1));
  write_all();
  hello();
  credit(1);
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  write_all();
  answer_batch(1);
  EXPECT_EQ(service_->scheduler().study(1).solved, 1U);
}

TEST_F(ServiceTest, ChangesThatAreThereAlreadyAreAnsweredAtOnce) {
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  EXPECT_EQ(last_reply().change().study().state(), "running");
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  EXPECT_EQ(last_reply().change().study().state(), "paused");
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  EXPECT_EQ(last_reply().change().retried(), 0U);
  EXPECT_TRUE(outbox_.jobs.empty());
}

TEST_F(ServiceTest, RetriedPointsAreHandedOutAgainOnceTheirRowsAreGone) {
  request(submit_request("a", 1));
  write_all();
  hello();
  credit(1);
  answer_batch(0);
  write_all();
  EXPECT_EQ(service_->scheduler().study(1).failed, 1U);
  credit(1);
  outbox_.worker_messages.clear();
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  EXPECT_TRUE(outbox_.worker_messages.empty()) << "not durable yet";
  write_all();
  EXPECT_EQ(last_reply().change().retried(), 1U);
  EXPECT_EQ(last_reply().change().study().state(), "running");
  EXPECT_EQ(service_->scheduler().study(1).failed, 0U);
  ASSERT_TRUE(last_message().has_batch());
  answer_batch(1);
  write_all();
  EXPECT_EQ(service_->scheduler().study(1).solved, 1U);
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  EXPECT_EQ(last_reply().change().study().state(), "done");
}

TEST_F(ServiceTest, AChangeThatIsNotStoredLeavesTheStudyAsItWas) {
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  write_all("disk full");
  EXPECT_THAT(last_reply().error().message(), HasSubstr("disk full"));
  hello();
  credit(1);
  EXPECT_TRUE(last_message().has_batch());
}

TEST_F(ServiceTest, APriorityOrWeightOutOfRangeIsRefusedByName) {
  auto heavy = submit_request("a");
  heavy.mutable_submit()->set_weight(-2.0);
  request(heavy);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("weight = -2"));
  auto urgent = submit_request("a");
  urgent.mutable_submit()->set_priority(100'000);
  request(urgent);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("priority = 100000"));
}

}  // namespace
}  // namespace oblique::server
