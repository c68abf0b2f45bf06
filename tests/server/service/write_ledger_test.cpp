#include "server/service/write_ledger.h"

#include <utility>

#include <gtest/gtest.h>

namespace oblique::server {
namespace {

class KeptJobs final : public ToWriter {
 public:
  void write(WriteJob job) override { jobs.push_back(std::move(job)); }
  std::vector<WriteJob> jobs;
};

class WriteLedgerTest : public testing::Test {
 protected:
  /// A message of that worker with so many bytes of results.
  void write_results(WorkerId worker, std::size_t bytes) {
    ledger_.write(AddResults{}, ResultsWrite{{worker, 1, ++sequence_, {}}, 1, bytes});
  }
  void write_change() {
    ledger_.write(SetStudyState{1, StudyState::kPaused, ""},
                  StateWrite{1, StudyState::kPaused, client_, false});
  }
  std::optional<Meaning> settle_first() {
    const std::uint64_t ticket = writer_.jobs.front().ticket;
    writer_.jobs.erase(writer_.jobs.begin());
    return ledger_.settle(ticket);
  }

  static LedgerLimits small() {
    LedgerLimits limits;
    limits.most_messages_of_worker = 3;
    limits.bytes_of_worker = 100;
    limits.bytes = 150;
    limits.bytes_to_hold = 50;
    limits.messages_to_hold = 6;
    limits.most_changes = 2;
    return limits;
  }

  KeptJobs writer_;
  WriteLedger ledger_{small(), writer_};
  std::uint64_t sequence_ = 0;
  Client client_{"client", 7};
};

TEST_F(WriteLedgerTest, AWriteIsGivenBackOnceWithWhatItStandsFor) {
  write_results(4, 10);
  write_change();
  ASSERT_EQ(writer_.jobs.size(), 2U);
  EXPECT_NE(writer_.jobs[0].ticket, writer_.jobs[1].ticket);
  const auto change = ledger_.settle(writer_.jobs[1].ticket);
  ASSERT_TRUE(change.has_value());
  EXPECT_EQ(std::get<StateWrite>(*change).client, client_);
  const auto results = ledger_.settle(writer_.jobs[0].ticket);
  ASSERT_TRUE(results.has_value());
  EXPECT_EQ(std::get<ResultsWrite>(*results).event.worker, 4U);
  EXPECT_EQ(ledger_.settle(writer_.jobs[0].ticket), std::nullopt);
  EXPECT_EQ(ledger_.settle(999), std::nullopt);
  EXPECT_TRUE(ledger_.is_empty());
}

TEST_F(WriteLedgerTest, OnlyWhereAClientWaitsIsAFailureReportedAtOnce) {
  ledger_.write(AddResults{}, ResultsWrite{});
  ledger_.write(AddWorker{}, QuietWrite{});
  ledger_.write(AddStudy{}, StudyWrite{});
  ledger_.write(SetStudyState{}, StateWrite{});
  ledger_.write(SetPriority{}, PriorityWrite{});
  ledger_.write(ForgetFailures{}, FailuresWrite{});
  std::vector<bool> reported;
  for (const WriteJob& job : writer_.jobs) {
    reported.push_back(job.answer_failure);
  }
  EXPECT_EQ(reported, (std::vector<bool>{false, false, true, true, true, true}));
}

TEST_F(WriteLedgerTest, ChangesOfClientsAreBoundedUntilSomeAreSettled) {
  write_results(1, 0);
  ledger_.write(AddWorker{}, QuietWrite{});
  write_change();
  EXPECT_FALSE(ledger_.takes_no_change());
  write_change();
  EXPECT_TRUE(ledger_.takes_no_change());
  settle_first();
  settle_first();
  EXPECT_TRUE(ledger_.takes_no_change()) << "those were not of clients";
  settle_first();
  EXPECT_FALSE(ledger_.takes_no_change());
}

TEST_F(WriteLedgerTest, BatchesAreHeldFromTheBoundInBytesUntilHalfOfThemAreStored) {
  write_results(1, 20);
  write_results(2, 10);
  write_results(1, 19);
  EXPECT_FALSE(ledger_.holds_batches());
  write_results(2, 1);
  EXPECT_TRUE(ledger_.holds_batches());
  settle_first();
  EXPECT_TRUE(ledger_.holds_batches()) << "30 bytes wait";
  settle_first();
  EXPECT_FALSE(ledger_.holds_batches()) << "20 wait, less than half";
  write_results(1, 20);
  EXPECT_FALSE(ledger_.holds_batches()) << "40: until the bound again";
}

TEST_F(WriteLedgerTest, BatchesAreHeldFromTheBoundInMessagesUntilHalfOfThemAreStored) {
  for (WorkerId worker = 1; worker <= 6; ++worker) {
    EXPECT_FALSE(ledger_.holds_batches());
    write_results(worker, 0);
  }
  for (int left = 5; left >= 3; --left) {
    EXPECT_TRUE(ledger_.holds_batches());
    settle_first();
  }
  EXPECT_TRUE(ledger_.holds_batches());
  settle_first();
  EXPECT_FALSE(ledger_.holds_batches());
}

TEST_F(WriteLedgerTest, TheBoundsOfADiskThatIsBehindAre16MiBAnd20000Messages) {
  const LedgerLimits limits;
  EXPECT_EQ(limits.bytes_to_hold, std::size_t{16} * 1024 * 1024);
  EXPECT_EQ(limits.messages_to_hold, 20'000U);
}

TEST_F(WriteLedgerTest, BatchesAreHeldWhileTheDatabaseTakesNothing) {
  ledger_.note_fault("disk full");
  EXPECT_TRUE(ledger_.holds_batches());
  EXPECT_EQ(ledger_.fault(), "disk full");
  ledger_.note_recovery();
  EXPECT_FALSE(ledger_.holds_batches());
  EXPECT_EQ(ledger_.fault(), "");
}

TEST_F(WriteLedgerTest, ARecoveryHandsOutNothingWhileTheDiskIsBehind) {
  ledger_.note_fault("disk full");
  write_results(1, 60);
  ledger_.note_recovery();
  EXPECT_TRUE(ledger_.holds_batches());
}

TEST_F(WriteLedgerTest, AWorkerHasRoomUntilItsOwnBytesOrThoseOfAllAreTooMany) {
  write_results(1, 99);
  EXPECT_TRUE(ledger_.has_room_for(1));
  write_results(1, 1);
  EXPECT_FALSE(ledger_.has_room_for(1));
  EXPECT_TRUE(ledger_.has_room_for(2));
  write_results(2, 50);
  EXPECT_FALSE(ledger_.has_room_for(2)) << "150 of all";
  EXPECT_FALSE(ledger_.has_room_for(3));
  settle_first();
  EXPECT_TRUE(ledger_.has_room_for(1));
  EXPECT_TRUE(ledger_.has_room_for(3));
}

TEST_F(WriteLedgerTest, AWorkerWithMoreMessagesThanSoundOnesKeepFloods) {
  write_results(1, 0);
  write_results(1, 0);
  EXPECT_FALSE(ledger_.is_flooded_by(1));
  write_results(1, 0);
  EXPECT_TRUE(ledger_.is_flooded_by(1));
  EXPECT_FALSE(ledger_.is_flooded_by(2));
  EXPECT_TRUE(ledger_.takes_no_worker());
  settle_first();
  EXPECT_FALSE(ledger_.is_flooded_by(1));
  EXPECT_FALSE(ledger_.takes_no_worker());
}

TEST_F(WriteLedgerTest, AllWorkersTogetherFloodItWhenAHundredOfThemWould) {
  for (WorkerId worker = 1; worker <= 299; ++worker) {
    write_results(worker, 0);
  }
  EXPECT_FALSE(ledger_.is_flooded_by(1000));
  write_results(300, 0);
  EXPECT_TRUE(ledger_.is_flooded_by(1000));
}

TEST_F(WriteLedgerTest, WhenTheDatabaseIsGoneAllThatIsOpenIsGivenUpInOrderAndNothingIsTaken) {
  write_results(1, 10);
  write_change();
  const auto given_up = ledger_.abandon("the file was deleted");
  ASSERT_EQ(given_up.size(), 2U);
  EXPECT_TRUE(std::holds_alternative<ResultsWrite>(given_up[0]));
  EXPECT_TRUE(std::holds_alternative<StateWrite>(given_up[1]));
  EXPECT_TRUE(ledger_.is_gone());
  EXPECT_TRUE(ledger_.is_empty());
  EXPECT_TRUE(ledger_.holds_batches());
  EXPECT_TRUE(ledger_.takes_no_worker());
  EXPECT_EQ(ledger_.fault(), "the file was deleted");
  EXPECT_EQ(ledger_.settle(writer_.jobs[0].ticket), std::nullopt) << "a late report";
}

}  // namespace
}  // namespace oblique::server
