// Peers of other versions, and those that do what no sound peer does.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "proto/result_message.h"
#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

WorkerMessage hello_of(std::uint32_t protocol_version, const std::string& solver_version) {
  WorkerMessage message;
  protocol::say_protocol(*message.mutable_hello());
  message.mutable_hello()->set_protocol_version(protocol_version);
  message.mutable_hello()->set_solver_version(solver_version);
  message.mutable_hello()->set_threads(1);
  return message;
}

TEST_F(ServiceTest, AWorkerWithAnotherSolverIsRefusedAndToldBothVersions) {
  worker_says(hello_of(protocol::kProtocolVersion, "0.9"));
  EXPECT_THAT(last_message().refused().reason(), AllOf(HasSubstr("0.9"), HasSubstr("1.0")));
  EXPECT_EQ(service_->scheduler().workers(), 0U);
}

TEST_F(ServiceTest, AStudyWithResultsOfAnotherSolverWaitsAndSaysForWhat) {
  StoredStudy stored{};
  stored.study_id = 1;
  stored.name = "a";
  stored.table = table_of(2);
  stored.completed = IntervalSet(0, 1);
  stored.solver_version = "0.9";
  ServiceSettings settings;
  settings.solver_version = "1.0";
  service_.emplace(settings, ports_, std::vector<StoredStudy>{stored}, now_);
  ClientRequest status;
  status.set_protocol_version(protocol::kProtocolVersion);
  status.mutable_status();
  request(status);
  EXPECT_THAT(last_reply().status().studies(0).waits_for(), HasSubstr("solver version 0.9"));
}

TEST_F(ServiceTest, AnotherPriorityIsAcknowledgedOnceItIsDurable) {
  submit("a");
  ClientRequest again = submit_request("a");
  again.mutable_submit()->set_priority(7);
  const std::size_t replies = ports_.replies.size();
  request(again);
  EXPECT_EQ(ports_.replies.size(), replies) << "not before it is written";
  write_all();
  EXPECT_TRUE(last_reply().has_submit());
  ClientRequest status;
  status.set_protocol_version(protocol::kProtocolVersion);
  status.mutable_status();
  request(status);
  EXPECT_EQ(last_reply().status().studies(0).priority(), 7);
  again.mutable_submit()->set_priority(8);
  request(again);
  write_all("the disk is full");
  EXPECT_THAT(last_reply().error().message(), HasSubstr("disk is full"));
}

TEST_F(ServiceTest, AWorkerWithOtherOutputsIsRefused) {
  for (const std::string& outputs : {std::string(), protocol::sent_outputs() + " new_N"}) {
    WorkerMessage message = hello_of(protocol::kProtocolVersion, "1.0");
    message.mutable_hello()->set_outputs(outputs);
    worker_says(message);
    EXPECT_THAT(last_message().refused().reason(), HasSubstr("other outputs"));
  }
  EXPECT_EQ(service_->scheduler().workers(), 0U);
}

TEST_F(ServiceTest, PeersOfAnyOtherProtocolVersionAreRefusedWithBothVersions) {
  const std::string own = fmt::format("version {}", protocol::kProtocolVersion);
  for (const std::uint32_t version :
       {0U, protocol::kProtocolVersion - 1, protocol::kProtocolVersion + 1, 77U}) {
    worker_says(hello_of(version, "1.0"));
    EXPECT_THAT(last_message().refused().reason(),
                HasSubstr(fmt::format("{}, the worker {}", own, version)));
    ClientRequest message = submit_request("a");
    message.set_protocol_version(version);
    request(message);
    EXPECT_THAT(last_reply().error().message(),
                HasSubstr(version == 0 ? std::string("the port for clients")
                                       : fmt::format("{}, the client {}", own, version)));
  }
  EXPECT_EQ(service_->scheduler().workers(), 0U);
}

TEST_F(ServiceTest, WhatAWorkerSaysOfItselfCannotForgeLines) {
  WorkerMessage message = hello_of(protocol::kProtocolVersion, "1.0");
  message.mutable_hello()->set_name("a\n\x1b[31mb");
  worker_says(message);
  EXPECT_THAT(ports_.lines.back(), HasSubstr("(a??[31mb, 1 threads) joins"));
}

TEST_F(ServiceTest, AWorkerWhoseConnectionIsGoneIsFoundAsSoonAsAHeartbeatIsLate) {
  submit("a");
  hello_and_credit();
  ports_.unreachable = "worker";
  now_.steady_ms += 1000;
  service_->tick(now_);
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  now_.steady_ms += 200;
  service_->tick(now_);
  EXPECT_EQ(service_->scheduler().workers(), 0U);
  EXPECT_EQ(service_->scheduler().study(1).leased, 0U);
}

TEST_F(ServiceTest, APointIsNotBlamedForWorkersThatWereGoneBeforeItWasSentToThem) {
  submit("a", 1);
  for (int i = 0; i < 10; ++i) {
    const std::string worker = "worker " + std::to_string(i);
    hello(worker);
    ports_.unreachable = worker;
    credit(1, worker);
    ports_.unreachable.clear();
    EXPECT_EQ(service_->scheduler().workers(), 0U);
  }
  ports_.worker_messages.clear();
  hello("sound");
  credit(1, "sound");
  ASSERT_TRUE(last_message().has_batch());
  EXPECT_EQ(last_message().batch().attempt(), 11U);
  EXPECT_NE(last_message().batch().study_id(), kProbeStudy) << "not suspect, and nobody vanished";
}

/// A service with small limits.
class FloodedServiceTest : public ServiceTest {
 protected:
  FloodedServiceTest() {
    ServiceSettings settings;
    settings.ledger.writes = 3;
    settings.ledger.changes = 3;
    start(settings);
  }
};

TEST_F(FloodedServiceTest, NoWorkerJoinsWhileTooMuchWaitsForTheDisk) {
  hello();
  WorkerMessage message;
  message.mutable_results()->set_study_id(1);
  for (std::uint64_t sequence = 1; sequence <= 3; ++sequence) {
    message.mutable_results()->set_sequence(sequence);
    worker_says(message);
  }
  hello("another");
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  write_all();
  hello("another");
  EXPECT_EQ(service_->scheduler().workers(), 2U);
}

TEST_F(FloodedServiceTest, ChangesBeyondTheLimitAreRefusedUntilTheDiskTookOthers) {
  for (const char* name : {"a", "b", "c", "d"}) {
    request(submit_request(name));
  }
  EXPECT_THAT(last_reply().error().message(), HasSubstr("ask again later"));
  write_all();
  submit("d");
  EXPECT_TRUE(last_reply().has_submit());
}

TEST_F(ServiceTest, AStudyWhoseResultsTheDiskDoesNotTakeSaysSoAndForgetsItAfterwards) {
  submit("a");
  hello();
  service_->written({WriteReport::Kind::kFault, 0, "disk full"}, now_);
  EXPECT_THAT(status_of("a").waits_for(), HasSubstr("disk full"));
  service_->written({WriteReport::Kind::kRecovered, 0, {}}, now_);
  EXPECT_THAT(status_of("a").waits_for(), IsEmpty());
}

}  // namespace
}  // namespace oblique::server
