// Tests of the service when the disk or a peer is slow.
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/service/write_ledger.h"
#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

class ServiceLoadTest : public ServiceTest {
 protected:
  /// Replaces the service by one with other settings, a study of 1000 points and a worker.
  void begin(const ServiceSettings& settings) {
    start(settings);
    submit("a", 1000);
    hello();
  }
  std::size_t batches_sent() const {
    std::size_t count = 0;
    for (const auto& message : ports_.worker_messages) {
      count += message.has_batch() ? 1U : 0U;
    }
    return count;
  }
};

TEST_F(ServiceLoadTest, NoBatchIsSentWhileTheDiskIsFarBehind) {
  ServiceSettings settings;
  settings.ledger.bytes = 4000;
  begin(settings);
  credit(1);
  EXPECT_EQ(batches_sent(), 1U);
  for (std::uint64_t point = 900; point < 910; ++point) {
    worker_sends(results_of({point}));
  }
  credit(1);
  EXPECT_EQ(batches_sent(), 1U);
  write_all();
  EXPECT_EQ(batches_sent(), 2U);
}

TEST_F(ServiceLoadTest, WhileReadingIsPausedAWorkerIsNotLostAndGetsHeartbeatReplies) {
  ServiceSettings settings;
  settings.ledger.bytes = 1;
  begin(settings);
  worker_sends(results_of({900}));
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
  EXPECT_EQ(service_->scheduler().workers(), 0U)
      << "a worker that is silent while it is read is lost";
}

TEST_F(ServiceLoadTest, AWorkerWithUnreadMessagesIsNotLost) {
  begin({});
  ports_.with_unread_input = "worker";
  pass(10'000);
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  ports_.with_unread_input.clear();
  pass(10'000);
  EXPECT_EQ(service_->scheduler().workers(), 0U);
}

TEST_F(ServiceLoadTest, AWorkerWhoseResultsWaitForTheDiskGetsHeartbeatReplies) {
  begin({});
  ports_.worker_messages.clear();
  for (std::uint64_t point = 900; point < 960; ++point) {
    now_.steady_ms += 100;
    worker_sends(results_of({point}));
    service_->tick(now_);
  }
  EXPECT_GE(ports_.worker_messages.size(), 4U) << "expected one heartbeat reply every 1.2 s";
  EXPECT_LE(ports_.worker_messages.size(), 6U);
}

TEST_F(ServiceLoadTest, AWorkerThatDoesNotReadGetsNoFurtherBatch) {
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

/// Provides a service with small limits.
class FloodedServiceTest : public ServiceTest {
 protected:
  FloodedServiceTest() {
    ServiceSettings settings;
    settings.ledger.writes = 3;
    settings.ledger.changes = 3;
    start(settings);
  }
};

TEST_F(FloodedServiceTest, NoWorkerJoinsWhileTheDiskIsTooFarBehind) {
  hello();
  WorkerMessage message;
  message.mutable_results()->set_study_id(1);
  for (std::uint64_t sequence = 1; sequence <= 3; ++sequence) {
    message.mutable_results()->set_sequence(sequence);
    worker_sends(message);
  }
  hello("another");
  EXPECT_EQ(service_->scheduler().workers(), 1U);
  write_all();
  hello("another");
  EXPECT_EQ(service_->scheduler().workers(), 2U);
}

TEST_F(FloodedServiceTest, ChangesBeyondTheLimitAreRefusedUntilOthersAreStored) {
  for (const char* name : {"a", "b", "c", "d"}) {
    request(submit_request(name));
  }
  EXPECT_THAT(last_error(), HasSubstr("try again later"));
  write_all();
  submit("d");
  EXPECT_TRUE(last_reply().has_submit());
}

// ---- Pending writes ----

class WriteLedgerTest : public testing::Test {
 protected:
  static LedgerLimits small() { return {.bytes = 200, .writes = 24, .changes = 3}; }

  /// Queues results that arrived in a message of `bytes` bytes.
  void write_results(std::size_t bytes) {
    AddResults change{};
    change.message_bytes = bytes;
    ledger_.write(std::move(change), [this](Instant) { outcomes_.emplace_back("results"); });
  }
  /// Queues a change. A client waits for its result.
  void write_change() {
    ledger_.write(
        SetStudyState{1, StudyState::kPaused, ""},
        [this](Instant) { outcomes_.emplace_back("change"); },
        [this](const std::string& error, Instant) { outcomes_.push_back(error); });
  }
  void store_first() {
    ledger_.end(ports_.jobs.front().ticket, std::nullopt, now_);
    ports_.jobs.erase(ports_.jobs.begin());
  }

  const Instant now_{};
  FakePorts ports_;
  WriteLedger ledger_{small(), ports_};
  std::vector<std::string> outcomes_;
};

TEST_F(WriteLedgerTest, EachWriteHasOneOutcome) {
  write_results(10);
  write_change();
  write_change();
  ASSERT_EQ(ports_.jobs.size(), 3U);
  EXPECT_FALSE(ports_.jobs[0].answer_failure)
      << "writing results is repeated until they are stored";
  EXPECT_TRUE(ports_.jobs[1].answer_failure) << "a client waits for the outcome";
  ledger_.end(ports_.jobs[1].ticket, std::nullopt, now_);
  ledger_.end(ports_.jobs[2].ticket, "the disk is full", now_);
  ledger_.end(ports_.jobs[0].ticket, std::nullopt, now_);
  ledger_.end(ports_.jobs[0].ticket, std::nullopt, now_);
  ledger_.end(999, "unknown", now_);
  EXPECT_EQ(outcomes_, (std::vector<std::string>{"change", "the disk is full", "results"}));
  EXPECT_TRUE(ledger_.is_empty());
}

TEST_F(WriteLedgerTest, BatchesAreHeldFromAQuarterOfTheBytesUntilHalfOfThatIsStored) {
  for (const std::size_t bytes : {20U, 10U, 19U}) {
    write_results(bytes);
  }
  EXPECT_FALSE(ledger_.holds_batches());
  write_results(1);
  EXPECT_TRUE(ledger_.holds_batches());
  store_first();
  EXPECT_TRUE(ledger_.holds_batches()) << "30 bytes wait";
  store_first();
  EXPECT_FALSE(ledger_.holds_batches()) << "20 bytes wait";
  write_results(20);
  EXPECT_FALSE(ledger_.holds_batches()) << "40 bytes wait";
}

TEST_F(WriteLedgerTest, BatchesAreHeldDuringAFaultAndAfterItWhileTheDiskIsBehind) {
  ledger_.set_fault("disk full");
  EXPECT_TRUE(ledger_.holds_batches());
  EXPECT_EQ(ledger_.fault(), "disk full");
  write_results(60);
  ledger_.set_fault({});
  EXPECT_TRUE(ledger_.holds_batches());
  store_first();
  EXPECT_FALSE(ledger_.holds_batches());
}

TEST_F(WriteLedgerTest, MessagesAreReadUntilBytesOrWritesReachTheirLimit) {
  write_results(199);
  EXPECT_TRUE(ledger_.has_room());
  write_results(1);
  EXPECT_FALSE(ledger_.has_room());
  store_first();
  store_first();
  for (int i = 0; i < 24; ++i) {
    EXPECT_TRUE(ledger_.has_room());
    write_results(0);
  }
  EXPECT_FALSE(ledger_.has_room());
}

TEST_F(WriteLedgerTest, ResultsAndChangesOfClientsHaveSeparateLimits) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(ledger_.has_room_for_changes());
    write_change();
  }
  EXPECT_FALSE(ledger_.has_room_for_changes());
  EXPECT_TRUE(ledger_.has_room());
  store_first();
  write_results(200);
  EXPECT_TRUE(ledger_.has_room_for_changes());
  EXPECT_FALSE(ledger_.has_room());
  ledger_.write(
      AddStudy{1, "a", StudyTable(std::string(limits::kUnstoredBytesOfChanges, 'x'), 1), ""}, {},
      [](const std::string&, Instant) {});
  EXPECT_FALSE(ledger_.has_room_for_changes()) << "recipes count as unstored bytes";
}

TEST_F(WriteLedgerTest, WhenTheDatabaseIsGoneAllWritesAreRefused) {
  write_results(10);
  write_change();
  ledger_.abandon("the file was deleted", now_);
  EXPECT_EQ(outcomes_, std::vector<std::string>{"the file was deleted"});
  EXPECT_TRUE(ledger_.is_gone());
  EXPECT_TRUE(ledger_.is_empty());
  EXPECT_TRUE(ledger_.holds_batches());
  EXPECT_EQ(ledger_.fault(), "the file was deleted");
  store_first();
  EXPECT_EQ(outcomes_.size(), 1U) << "a late report has no effect";
}

}  // namespace
}  // namespace oblique::server
