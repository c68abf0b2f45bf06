#include "server/store/writer.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <iterator>
#include <map>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;
using Kind = WriteReport::Kind;

/// A storage whose operations fail on request.
class TestStorage final : public Storage {
 public:
  void commit(std::span<const Change> changes) override {
    check();
    std::ranges::for_each(changes, on_change);
    sizes.push_back(changes.size());
    for (const Change& change : changes) {
      if (const auto* worker = std::get_if<AddWorker>(&change)) {
        workers.push_back(worker->worker_id);
      }
    }
    is_gone = is_gone || goes_in_commit;
    check();
  }
  void check() override {
    if (is_gone) {
      throw StorageGone("the file was deleted");
    }
  }
  ClearedAway clear_away(std::size_t /*most*/) override {
    check();
    if (is_full) {
      throw StorageError("the disk is full");
    }
    if (parts_left == 0) {
      return ClearedAway::kAll;
    }
    --parts_left;
    return ClearedAway::kPart;
  }
  bool merge_log() override {
    check();
    return ++merges >= merged_at;
  }
  void interrupt() override {
    is_interrupted = true;
    is_interrupted.notify_all();
  }

  /// Runs for each change in a commit. An exception makes the commit fail.
  std::function<void(const Change&)> on_change = [this](const Change&) {
    if (is_full) {
      throw StorageError("the disk is full");
    }
  };
  std::atomic<bool> is_full = false;
  bool is_gone = false;
  bool goes_in_commit = false;
  int merges = 0;
  int merged_at = 1;  ///< number of the first call of `merge_log` that succeeds
  std::atomic<int> parts_left = 0;
  std::atomic<bool> is_interrupted = false;
  std::vector<std::size_t> sizes;      ///< changes per successful commit
  std::vector<std::uint64_t> workers;  ///< added workers
};

WriteJob kept(std::uint64_t ticket) {
  return {ticket, AddWorker{ticket, "", 1, "", "", ""}, false};
}
WriteJob answered(std::uint64_t ticket, std::uint64_t study = 1) {
  return {ticket, SetStudyState{study, StudyState::kDone, ""}, true};
}

// ---- Groups of changes --------------------------------------------------------------------------

/// Kind and ticket of each report.
using Reports = std::vector<std::pair<Kind, std::uint64_t>>;

Reports kinds_and_tickets(const std::vector<WriteReport>& reports) {
  Reports found;
  for (const WriteReport& report : reports) {
    found.emplace_back(report.kind, report.ticket);
  }
  return found;
}

class GroupCommitTest : public testing::Test {
 protected:
  Reports write() { return kinds_and_tickets(commits_.write(jobs_)); }

  TestStorage storage_;
  GroupCommit commits_{storage_};
  std::deque<WriteJob> jobs_;
};

TEST_F(GroupCommitTest, OneBadChangeDoesNotBlockTheOthers) {
  storage_.on_change = [](const Change& change) {
    if (std::holds_alternative<SetStudyState>(change)) {
      throw StorageError("bad");
    }
  };
  jobs_ = {kept(1), answered(2), kept(3)};
  EXPECT_EQ(write(), (Reports{{Kind::kStored, 1}, {Kind::kRefused, 2}, {Kind::kStored, 3}}));
}

TEST_F(GroupCommitTest, ResultsWaitWhileDiskOrMemoryIsFull) {
  for (const bool is_memory : {false, true}) {
    storage_.workers.clear();
    storage_.on_change = [is_memory](const Change&) {
      is_memory ? throw std::bad_alloc() : throw StorageError("the disk is full");
    };
    jobs_ = {kept(1), kept(2)};
    EXPECT_EQ(write(), (Reports{{Kind::kFault, 0}}));
    EXPECT_THAT(write(), IsEmpty()) << "reported once";
    EXPECT_TRUE(commits_.is_faulty());
    storage_.on_change = [](const Change&) {};
    EXPECT_EQ(write(), (Reports{{Kind::kRecovered, 0}, {Kind::kStored, 1}, {Kind::kStored, 2}}));
    EXPECT_FALSE(commits_.is_faulty());
    EXPECT_THAT(storage_.workers, ElementsAre(1, 2));
  }
}

TEST_F(GroupCommitTest, AResultThatContradictsTheFileEndsTheWriterAndAChangeOfAClientIsRefused) {
  storage_.on_change = [](const Change&) { throw ChangeRefused("UNIQUE constraint failed"); };
  jobs_ = {answered(1)};
  EXPECT_EQ(write(), (Reports{{Kind::kRefused, 1}}));
  jobs_ = {kept(2)};
  EXPECT_EQ(write(), (Reports{{Kind::kGone, 0}}));
  EXPECT_TRUE(commits_.is_gone());
}

TEST_F(GroupCommitTest, ALaterChangeDoesNotOvertakeAWaitingOneOfItsStudy) {
  storage_.on_change = [](const Change& change) {
    if (!std::holds_alternative<ForgetFailures>(change)) {
      throw StorageError("the disk is full");
    }
  };
  jobs_.push_back({1, SetStudyState{1, StudyState::kDone, ""}, false});
  jobs_.push_back({2, ForgetFailures{1, IntervalSet(0, 1), ""}, true});
  jobs_.push_back({3, ForgetFailures{2, IntervalSet(0, 1), ""}, true});
  EXPECT_EQ(write(), (Reports{{Kind::kRefused, 2}, {Kind::kStored, 3}, {Kind::kFault, 0}}));
  ASSERT_EQ(jobs_.size(), 1U);
  EXPECT_EQ(jobs_.front().ticket, 1U);
}

TEST_F(GroupCommitTest, ALookupOfResultsIsTheLastChangeOfItsTransactionAndMayFailAlone) {
  const std::deque<WriteJob> jobs{kept(1),
                                  {2, ReuseResults{1, nullptr, 0, "", nullptr}, true},
                                  {3, ReuseResults{2, nullptr, 0, "", nullptr}, true},
                                  kept(4)};
  for (jobs_ = jobs; !jobs_.empty();) {
    write();
  }
  EXPECT_THAT(storage_.sizes, ElementsAre(2, 1, 1));
  storage_.on_change = [](const Change& change) {
    if (std::holds_alternative<ReuseResults>(change)) {
      throw StorageError("a page is damaged");
    }
  };
  jobs_ = jobs;
  EXPECT_THAT(write(),
              UnorderedElementsAre(std::pair(Kind::kStored, 1), std::pair(Kind::kRefused, 2),
                                   std::pair(Kind::kRefused, 3), std::pair(Kind::kStored, 4)));
  EXPECT_THAT(jobs_, IsEmpty());
  EXPECT_FALSE(commits_.is_faulty());
}

TEST_F(GroupCommitTest, CommitsToADeletedFileAreNotReportedAsStored) {
  storage_.goes_in_commit = true;
  jobs_ = {kept(1), answered(2)};
  EXPECT_EQ(write(), (Reports{{Kind::kGone, 0}}));
  EXPECT_THAT(storage_.sizes, ElementsAre(2)) << "both changes are in one transaction";
  EXPECT_EQ(jobs_.size(), 2U) << "both changes remain unstored";
  EXPECT_THAT(write(), IsEmpty()) << "reported once, never tried again";
  EXPECT_THAT(storage_.sizes, ElementsAre(2));
}

TEST_F(GroupCommitTest, EveryOperationDetectsAMissingFile) {
  using Way = std::function<void(GroupCommit&, std::vector<WriteReport>&)>;
  const std::vector<Way> ways{
      [](auto& commits, auto& reports) { reports = commits.maintain(); },
      [](auto& commits, auto& reports) { EXPECT_FALSE(commits.merge(reports)); },
      [](auto& commits, auto& reports) { EXPECT_FALSE(commits.clear(10, reports)); }};
  storage_.is_gone = true;
  for (const auto& way : ways) {
    GroupCommit commits(storage_);
    commits.resume_deletions();
    std::vector<WriteReport> reports;
    way(commits, reports);
    EXPECT_EQ(kinds_and_tickets(reports), (Reports{{Kind::kGone, 0}}));
    EXPECT_TRUE(commits.is_gone());
    EXPECT_FALSE(commits.has_to_clear());
    EXPECT_THAT(commits.maintain(), IsEmpty()) << "reported once";
  }
}

TEST_F(GroupCommitTest, TheLogIsMergedWhenAStudyIsDoneAsSoonAsReadersAllowIt) {
  commits_.maintain();
  EXPECT_EQ(storage_.merges, 0) << "no study is done";
  jobs_ = {kept(1), answered(2)};
  write();
  storage_.merged_at = 8;
  std::vector<WriteReport> reports;
  for (int i = 0; i < 20; ++i) {
    std::ranges::move(commits_.maintain(), std::back_inserter(reports));
  }
  EXPECT_EQ(storage_.merges, 8);
  EXPECT_EQ(kinds_and_tickets(reports), (Reports{{Kind::kUnmerged, 0}})) << "reported once";
}

TEST_F(GroupCommitTest, AFailedDeletionStepIsRepeatedWithoutAReport) {
  EXPECT_FALSE(commits_.has_to_clear()) << "no deletion has been committed yet";
  commits_.resume_deletions();
  storage_.parts_left = 2;
  std::vector<WriteReport> reports;
  EXPECT_TRUE(commits_.clear(10, reports));
  storage_.is_full = true;
  EXPECT_FALSE(commits_.clear(10, reports));
  EXPECT_TRUE(commits_.has_to_clear());
  storage_.is_full = false;
  EXPECT_TRUE(commits_.clear(10, reports));
  EXPECT_TRUE(commits_.clear(10, reports));
  EXPECT_FALSE(commits_.has_to_clear());
  EXPECT_THAT(reports, IsEmpty());
}

// ---- The writer on its thread -------------------------------------------------------------------

/// Runs a writer on its thread; tests can wait for its reports.
class WriterTest : public testing::Test {
 protected:
  Kind wait_for_ticket(std::uint64_t ticket) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return of_ticket_.contains(ticket); });
    return of_ticket_[ticket];
  }
  std::size_t count(Kind kind) {
    const std::lock_guard lock(mutex_);
    return kinds_[kind];
  }
  void take(const std::vector<WriteReport>& reports) {
    const std::lock_guard lock(mutex_);
    for (const auto& report : reports) {
      ++kinds_[report.kind];
      of_ticket_[report.ticket] = report.kind;
    }
    arrived_.notify_all();
  }

  TestStorage storage_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<Kind, std::size_t> kinds_;
  std::map<std::uint64_t, Kind> of_ticket_;
  Writer writer_{storage_, [this](const std::vector<WriteReport>& reports) { take(reports); },
                 std::chrono::milliseconds(1)};
};

TEST_F(WriterTest, ManyJobsShareATransactionAndStayInOrder) {
  constexpr std::uint64_t kJobs = 2000;
  std::vector<std::uint64_t> expected;
  for (std::uint64_t ticket = 1; ticket <= kJobs; ++ticket) {
    writer_.submit(kept(ticket));
    expected.push_back(ticket);
  }
  EXPECT_EQ(writer_.finish(), 0U);
  EXPECT_EQ(storage_.workers, expected);
  EXPECT_EQ(count(Kind::kStored), kJobs);
}

TEST_F(WriterTest, AStatementThatNeverEndsIsInterruptedWhenTheWriterStops) {
  storage_.on_change = [this](const Change&) {
    storage_.is_interrupted.wait(false);
    throw StorageError("interrupted");
  };
  writer_.submit(kept(1));
  EXPECT_EQ(writer_.finish(), 1U) << "it is not durable";
}

TEST_F(WriterTest, AStoppingWriterTriesSeveralTimesToMergeTheLogAndReportsFailure) {
  storage_.merged_at = 1'000'000;
  writer_.submit(kept(1));
  EXPECT_EQ(writer_.finish(), 0U);
  EXPECT_GE(storage_.merges, 3);
  EXPECT_EQ(count(Kind::kUnmerged), 1U);
}

TEST_F(WriterTest, RowsOfDeletedStudiesAreDeletedBetweenWritesAndWhenIdle) {
  writer_.submit(kept(1));
  ASSERT_EQ(wait_for_ticket(1), Kind::kStored);
  storage_.parts_left = 300;
  writer_.submit({2, DeleteStudy{7}, true});
  ASSERT_EQ(wait_for_ticket(2), Kind::kStored);
  for (std::uint64_t ticket = 3; storage_.parts_left > 0; ++ticket) {
    writer_.submit(kept(ticket));
    EXPECT_EQ(wait_for_ticket(ticket), Kind::kStored)
        << "a change must be written between parts of a deletion";
  }
  EXPECT_EQ(writer_.finish(), 0U);
}

}  // namespace
}  // namespace oblique::server
