// Connections and the worker processes behind them, probes, and workers of the previous protocol.
#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

class ProcessesTest : public ServiceTest {
 protected:
  void hello_as(const std::string& identity, const std::string& process_id,
                const std::string& name = "lab") {
    WorkerMessage message;
    protocol::say_protocol(*message.mutable_hello());
    message.mutable_hello()->set_solver_version("1.0");
    message.mutable_hello()->set_name(name);
    message.mutable_hello()->set_threads(1);
    message.mutable_hello()->set_process_id(process_id);
    worker_says(message, identity);
  }
  protocol::WorkersReply workers() {
    ClientRequest message;
    message.set_protocol_version(protocol::kProtocolVersion);
    message.mutable_workers();
    request(message);
    return last_reply().workers();
  }
  /// The worker at `identity` solves a batch and says goodbye.
  void solve_and_leave(const std::string& identity) {
    credit(1, identity);
    answer_batch(1000, identity);
    WorkerMessage goodbye;
    goodbye.mutable_goodbye();
    worker_says(goodbye, identity);
  }
  /// Three newcomers get batches and are gone.
  void let_newcomers_vanish() {
    for (const char* identity : {"x", "y", "z"}) {
      hello_as(identity, identity);
      credit(1, identity);
      EXPECT_TRUE(last_message().has_batch());
      outbox_.unreachable = identity;
      now_.steady_ms += 1200;
      service_->tick(now_);
    }
    outbox_.unreachable.clear();
  }
};

TEST_F(ProcessesTest, AProcessOnANewConnectionGetsAtOnceWhatItHeldOnTheOldOne) {
  request(submit_request("a", 1));
  write_all();
  hello_as("first", "process 1");
  credit(1, "first");
  hello_as("second", "process 1");
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  credit(1, "second");
  EXPECT_TRUE(last_message().has_batch());
  credit(1, "first");
  EXPECT_TRUE(last_message().has_hello_again()) << "the old connection is nobody's any more";
}

TEST_F(ProcessesTest, WorkersOfOneNameAreDifferentProcesses) {
  request(submit_request("a", 100));
  write_all();
  hello_as("first", "process 1", "box:12");
  solve_and_leave("first");
  hello_as("second", "process 2", "box:12");
  EXPECT_FALSE(workers().workers(0).proven());
}

TEST_F(ProcessesTest, WorkersSayWhatWasLostWithTheirProcess) {
  request(submit_request("a", 100));
  write_all();
  hello_as("first", "process 1");
  credit(2, "first");
  hello_as("second", "process 1");
  const auto worker = workers().workers(0);
  EXPECT_EQ(worker.losses(), 2U);
  EXPECT_FALSE(worker.proven());
  EXPECT_FALSE(worker.set_aside());
}

TEST_F(ProcessesTest, AProbeIsAStudyOfOnePointThatAnyWorkerReadsAndItsResultIsAcknowledged) {
  request(submit_request("a", 100));
  write_all();
  let_newcomers_vanish();
  hello_as("worker", "sound");
  EXPECT_TRUE(workers().workers(0).set_aside());
  credit(1);
  ASSERT_TRUE(last_message().has_batch());
  const auto batch = last_message().batch();
  EXPECT_EQ(batch.study_id(), 0U);
  EXPECT_EQ(points_of(batch).size(), 1U);
  const auto& definition = outbox_.worker_messages.at(outbox_.worker_messages.size() - 2);
  ASSERT_TRUE(definition.has_study());
  EXPECT_EQ(definition.study().study_id(), 0U);
  EXPECT_EQ(protocol::PointTable(definition.study().recipe()).size(), 1U);
  answer_batch(1);
  EXPECT_TRUE(last_message().has_results_stored());
  EXPECT_TRUE(workers().workers(0).proven());
  EXPECT_EQ(workers().workers(0).solved_points(), 0U);
  credit(1);
  ASSERT_TRUE(last_message().has_batch());
  EXPECT_EQ(last_message().batch().study_id(), 1U);
}

TEST_F(ProcessesTest, ABatchThatAnotherWorkerSolvedIsReleased) {
  request(submit_request("a", 1));
  write_all();
  hello_as("slow", "slow", "slow");
  credit(1, "slow");
  hello();
  credit(1);
  for (int i = 0; i < 8 && !last_message().has_batch(); ++i) {
    now_.steady_ms += 250;
    credit(0, "slow");
    credit(0);
    service_->tick(now_);
  }
  ASSERT_TRUE(last_message().has_batch());
  answer_batch(1);
  const auto releases =
      std::count_if(outbox_.worker_messages.begin(), outbox_.worker_messages.end(),
                    [](const ServerToWorker& message) { return message.has_release(); });
  EXPECT_EQ(releases, 1);
}

TEST_F(ProcessesTest, ABatchMayBeOfSeveralModels) {
  ClientRequest submit = submit_request("models");
  *submit.mutable_submit()->mutable_recipe() =
      protocol::recipe_of({{protocol::range("k", 1e7, 2e7, 100), protocol::listed("H", {1.0}),
                            protocol::listed("mu", {0.4}), protocol::listed("e", {1.0})}});
  request(submit);
  write_all();
  hello();
  credit(1);
  EXPECT_EQ(points_of(last_message().batch()).size(), 8U);
}

}  // namespace
}  // namespace oblique::server
