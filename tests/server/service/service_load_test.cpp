// What the service does when the disk or a peer does not keep up.
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

class ServiceLoadTest : public ServiceTest {
 protected:
  /// Begins anew with other settings, a study of 1000 points and a worker.
  void begin(ServiceSettings settings) {
    settings.solver_version = "1.0";
    settings.database_id = "db";
    service_.emplace(settings, ports_, std::vector<StoredStudy>{}, now_);
    request(submit_request("a", 1000));
    write_all();
    hello();
    write_all();
  }
  /// One result of the last batch, without an end of it.
  WorkerMessage one_result(std::uint64_t point) {
    WorkerMessage message;
    auto& results = *message.mutable_results();
    results.set_study_id(1);
    results.set_sequence(++sequence_);
    *results.add_results() = solved(point);
    return message;
  }
  std::size_t batches_sent() const {
    std::size_t count = 0;
    for (const auto& message : ports_.worker_messages) {
      count += message.has_batch() ? 1U : 0U;
    }
    return count;
  }
};

TEST_F(ServiceLoadTest, NoBatchGoesOutWhileTheDiskIsFarBehind) {
  ServiceSettings settings;
  settings.ledger.bytes = 4000;
  begin(settings);
  credit(1);
  EXPECT_EQ(batches_sent(), 1U);
  for (std::uint64_t point = 900; point < 910; ++point) {
    worker_says(one_result(point));
  }
  credit(1);
  EXPECT_EQ(batches_sent(), 1U);
  write_all();
  EXPECT_EQ(batches_sent(), 2U);
}

TEST_F(ServiceLoadTest, WorkersAreNotReadWhileTooMuchWaitsForTheDisk) {
  ServiceSettings settings;
  settings.ledger.bytes = 500;
  begin(settings);
  for (std::uint64_t point = 900; service_->has_room("worker") && point < 1000; ++point) {
    worker_says(one_result(point));
  }
  EXPECT_FALSE(service_->has_room("worker"));
  write_all();
  EXPECT_TRUE(service_->has_room("worker"));
}

TEST_F(ServiceLoadTest, AWorkerThatIsNotHeardIsNotTakenForSilentAndHearsThatTheServerLives) {
  ServiceSettings settings;
  settings.ledger.bytes = 1;
  begin(settings);
  worker_says(one_result(900));
  ports_.worker_messages.clear();
  pass(10'000);
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  std::size_t signs = 0;
  for (const auto& message : ports_.worker_messages) {
    signs += message.has_heartbeat_reply() ? 1U : 0U;
  }
  EXPECT_GE(signs, 5U);
  write_all();
  pass(10'000);
  EXPECT_EQ(service_->scheduler().workers(), 0U) << "now it is silent indeed";
}

TEST_F(ServiceLoadTest, AWorkerWhoseMessagesWaitToBeTakenIsNotTakenForSilent) {
  begin({});
  ports_.unheard = "worker";
  pass(10'000);
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  ports_.unheard.clear();
  pass(10'000);
  EXPECT_EQ(service_->scheduler().workers(), 0U);
}

TEST_F(ServiceLoadTest, AWorkerWhoseResultsWaitForTheDiskHearsSignsOfLifeThoughItGoesOnSpeaking) {
  begin({});
  ports_.worker_messages.clear();
  for (std::uint64_t point = 900; point < 960; ++point) {
    now_.steady_ms += 100;
    worker_says(one_result(point));
    service_->tick(now_);
  }
  EXPECT_GE(ports_.worker_messages.size(), 4U) << "one in 1.2 s";
  EXPECT_LE(ports_.worker_messages.size(), 6U);
}

TEST_F(ServiceLoadTest, AWorkerThatDoesNotReadGetsNoFurtherBatchAndNoStudyCountsAsLost) {
  begin({});
  ports_.busy = "worker";
  credit(1);
  EXPECT_EQ(batches_sent(), 1U);
  credit(1);
  EXPECT_EQ(batches_sent(), 1U);
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  ports_.busy.clear();
  service_->tick(now_);
  EXPECT_EQ(batches_sent(), 2U);
}

}  // namespace
}  // namespace oblique::server
