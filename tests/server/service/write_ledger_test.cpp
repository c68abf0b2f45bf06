#include "server/service/write_ledger.h"

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

class WriteLedgerTest : public testing::Test {
 protected:
  static LedgerLimits small() {
    return {.bytes = 200, .writes = 24, .bytes_of_worker = 50, .changes = 3};
  }

  /// A results message of so many bytes.
  void write_results(std::size_t bytes, WorkerId worker = 0) {
    AddResults change{};
    change.worker_id = worker;
    change.message_bytes = bytes;
    ledger_.write(std::move(change), [this](Instant) { outcomes_.emplace_back("results"); });
  }
  /// A change that a client waits for.
  void write_change() {
    ledger_.write(
        SetStudyState{1, StudyState::kPaused, ""},
        [this](Instant) { outcomes_.emplace_back("change"); },
        [this](const std::string& error, Instant) { outcomes_.push_back(error); });
  }
  void store_first() {
    ledger_.stored(ports_.jobs.front().ticket, now_);
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
  EXPECT_FALSE(ports_.jobs[0].answer_failure) << "results are tried until they are stored";
  EXPECT_TRUE(ports_.jobs[1].answer_failure) << "a client waits";
  ledger_.stored(ports_.jobs[1].ticket, now_);
  ledger_.refused(ports_.jobs[2].ticket, "the disk is full", now_);
  ledger_.stored(ports_.jobs[0].ticket, now_);
  ledger_.stored(ports_.jobs[0].ticket, now_);
  ledger_.refused(999, "unknown", now_);
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

TEST_F(WriteLedgerTest, BatchesAreHeldFromAQuarterOfTheWritesUntilHalfOfThatIsStored) {
  for (int i = 0; i < 6; ++i) {
    EXPECT_FALSE(ledger_.holds_batches());
    write_results(0);
  }
  for (int left = 6; left >= 3; --left) {
    EXPECT_TRUE(ledger_.holds_batches()) << left;
    store_first();
  }
  EXPECT_FALSE(ledger_.holds_batches());
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

TEST_F(WriteLedgerTest, MessagesAreTakenUntilTheBytesOrWritesAreTooMany) {
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

TEST_F(WriteLedgerTest, AWorkerHasAShareOfTheBytes) {
  write_results(30, 1);
  write_results(20, 1);
  EXPECT_FALSE(ledger_.has_room(1));
  EXPECT_TRUE(ledger_.has_room(2));
  EXPECT_TRUE(ledger_.has_room());
  store_first();
  EXPECT_TRUE(ledger_.has_room(1));
  write_results(200, 2);
  EXPECT_FALSE(ledger_.has_room(1)) << "all have too many";
}

TEST_F(WriteLedgerTest, ResultsAndChangesOfClientsHaveBoundsOfTheirOwn) {
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
  EXPECT_FALSE(ledger_.has_room_for_changes()) << "recipes count, too";
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
  EXPECT_EQ(outcomes_.size(), 1U) << "a late report";
}

}  // namespace
}  // namespace oblique::server
