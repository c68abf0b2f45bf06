#include "server/store/writer.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <new>
#include <thread>

#include <gtest/gtest.h>

#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

using Kind = WriteReport::Kind;

/// A disk that fails when it is told to, and that remembers what was committed.
class FailingStorage final : public Storage {
 public:
  void commit(std::span<const Change> changes) override {
    const std::lock_guard lock(mutex_);
    ++attempts_;
    if (out_of_memory_) {
      throw std::bad_alloc();
    }
    for (const Change& change : changes) {
      const auto* state = std::get_if<SetStudyState>(&change);
      if (full_ || (state != nullptr && state->study_id == kBad)) {
        throw StorageError("the disk is full");
      }
    }
    for (const Change& change : changes) {
      if (const auto* worker = std::get_if<AddWorker>(&change)) {
        committed_.push_back(worker->worker_id);
      }
    }
  }

  /// As many steps as `leave` said.
  ClearedAway clear_away(std::size_t /*most*/) override {
    const std::lock_guard lock(mutex_);
    if (full_) {
      throw StorageError("the disk is full");
    }
    if (left_ == 0) {
      return ClearedAway::kAll;
    }
    --left_;
    return ClearedAway::kPart;
  }
  void leave(int steps) {
    const std::lock_guard lock(mutex_);
    left_ = steps;
  }
  int left() {
    const std::lock_guard lock(mutex_);
    return left_;
  }

  static constexpr std::uint64_t kBad = 666;  // a change of this study always fails

  void set_full(bool full) {
    const std::lock_guard lock(mutex_);
    full_ = full;
  }
  void set_out_of_memory(bool out_of_memory) {
    const std::lock_guard lock(mutex_);
    out_of_memory_ = out_of_memory;
  }
  std::vector<std::uint64_t> committed() {
    const std::lock_guard lock(mutex_);
    return committed_;
  }
  int attempts() {
    const std::lock_guard lock(mutex_);
    return attempts_;
  }

 private:
  std::mutex mutex_;
  bool full_ = false;
  bool out_of_memory_ = false;
  int attempts_ = 0;
  int left_ = 0;
  std::vector<std::uint64_t> committed_;
};

/// Collects reports and lets a test wait for one.
class Reports {
 public:
  void take(const std::vector<WriteReport>& reports) {
    const std::lock_guard lock(mutex_);
    for (const auto& report : reports) {
      kinds_.push_back(report.kind);
      if (report.ticket != 0) {
        of_ticket_[report.ticket] = report.kind;
      }
    }
    arrived_.notify_all();
  }
  void wait_for(Kind kind) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return std::count(kinds_.begin(), kinds_.end(), kind) > 0; });
  }
  Kind wait_for_ticket(std::uint64_t ticket) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return of_ticket_.contains(ticket); });
    return of_ticket_[ticket];
  }
  std::ptrdiff_t count(Kind kind) {
    const std::lock_guard lock(mutex_);
    return std::count(kinds_.begin(), kinds_.end(), kind);
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<Kind> kinds_;
  std::map<std::uint64_t, Kind> of_ticket_;
};

class WriterTest : public testing::Test {
 protected:
  static WriteJob kept(std::uint64_t ticket) {
    return {ticket, AddWorker{ticket, "", 1, "", "", ""}, false};
  }
  static WriteJob answered(std::uint64_t ticket, std::uint64_t study = 1) {
    return {ticket, SetStudyState{study, StudyState::kDone, ""}, true};
  }

  FailingStorage storage_;
  Reports reports_;
  Writer writer_{storage_, [this](const std::vector<WriteReport>& r) { reports_.take(r); }};
};

TEST_F(WriterTest, ManyJobsShareATransactionAndStayInOrder) {
  std::vector<std::uint64_t> expected;
  for (std::uint64_t ticket = 1; ticket <= 2000; ++ticket) {
    writer_.submit(kept(ticket));
    expected.push_back(ticket);
  }
  EXPECT_EQ(writer_.finish(), 0U);
  EXPECT_EQ(storage_.committed(), expected);
  EXPECT_EQ(reports_.count(Kind::kStored), 2000);
}

TEST_F(WriterTest, AFailureIsAnsweredToWhoWaits) {
  storage_.set_full(true);
  writer_.submit(answered(1));
  EXPECT_EQ(reports_.wait_for_ticket(1), Kind::kRefused);
}

TEST_F(WriterTest, OneBadChangeDoesNotTakeTheOthersWithIt) {
  writer_.submit(kept(1));
  writer_.submit(answered(2, FailingStorage::kBad));
  writer_.submit(kept(3));
  EXPECT_EQ(reports_.wait_for_ticket(1), Kind::kStored);
  EXPECT_EQ(reports_.wait_for_ticket(2), Kind::kRefused);
  EXPECT_EQ(reports_.wait_for_ticket(3), Kind::kStored);
}

TEST_F(WriterTest, ResultsWaitForAFullDiskAndAreWrittenWhenThereIsRoom) {
  storage_.set_full(true);
  writer_.submit(kept(1));
  writer_.submit(kept(2));
  reports_.wait_for(Kind::kFault);
  EXPECT_EQ(reports_.count(Kind::kStored), 0);
  storage_.set_full(false);
  EXPECT_EQ(reports_.wait_for_ticket(2), Kind::kStored);
  EXPECT_EQ(reports_.count(Kind::kRecovered), 1);
  EXPECT_EQ(reports_.count(Kind::kFault), 1);
  EXPECT_EQ(storage_.committed(), (std::vector<std::uint64_t>{1, 2}));
}

TEST_F(WriterTest, ResultsWaitWhileThereIsNoMemoryAndAreWrittenWhenThereIs) {
  storage_.set_out_of_memory(true);
  writer_.submit(kept(1));
  writer_.submit(kept(2));
  reports_.wait_for(Kind::kFault);
  EXPECT_EQ(reports_.count(Kind::kStored), 0);
  storage_.set_out_of_memory(false);
  EXPECT_EQ(reports_.wait_for_ticket(2), Kind::kStored);
  EXPECT_EQ(reports_.count(Kind::kRecovered), 1);
  EXPECT_EQ(reports_.count(Kind::kFault), 1);
  EXPECT_EQ(storage_.committed(), (std::vector<std::uint64_t>{1, 2}));
}

TEST(WriterEndTest, AStatementThatNeverEndsIsInterruptedAtTheEnd) {
  class Endless final : public Storage {
   public:
    void commit(std::span<const Change> /*changes*/) override {
      is_interrupted_.wait(false);
      throw StorageError("interrupted");
    }
    void interrupt() override {
      is_interrupted_ = true;
      is_interrupted_.notify_all();
    }

   private:
    std::atomic<bool> is_interrupted_ = false;
  };
  Endless storage;
  Writer writer(
      storage, [](const auto&) {}, std::chrono::milliseconds(1));
  writer.submit({1, AddWorker{1, "", 1, "", "", ""}, false});
  EXPECT_EQ(writer.finish(), 1U) << "it is not durable";
}

TEST(GroupCommitTest, AChangeThatWaitsIsNotOvertakenByALaterOneOfItsStudy) {
  // Takes retries, and nothing else.
  class OnlyRetries final : public Storage {
   public:
    void commit(std::span<const Change> changes) override {
      for (const Change& change : changes) {
        if (!std::holds_alternative<ForgetFailures>(change)) {
          throw StorageError("the disk is full");
        }
      }
      ++retries;
    }
    int retries = 0;
  };
  OnlyRetries storage;
  GroupCommit commits(storage);
  std::deque<WriteJob> jobs;
  jobs.push_back({1, SetStudyState{1, StudyState::kDone, ""}, false});
  jobs.push_back({2, ForgetFailures{1, IntervalSet(0, 1), ""}, true});
  jobs.push_back({3, ForgetFailures{2, IntervalSet(0, 1), ""}, true});
  std::map<std::uint64_t, Kind> became;
  for (const auto& report : commits.write(jobs)) {
    became[report.ticket] = report.kind;
  }
  EXPECT_EQ(became[2], Kind::kRefused);
  EXPECT_EQ(became[3], Kind::kStored) << "of another study";
  EXPECT_EQ(storage.retries, 1);
  ASSERT_EQ(jobs.size(), 1U);
  EXPECT_EQ(jobs.front().ticket, 1U);
}

/// Notes how many changes each commit has; refuses lookups of results if `is_damaged`.
class LookupStorage final : public Storage {
 public:
  void commit(std::span<const Change> changes) override {
    for (const Change& change : changes) {
      if (is_damaged && std::holds_alternative<ReuseResults>(change)) {
        throw StorageError("a page is damaged");
      }
    }
    sizes.push_back(changes.size());
  }
  bool is_damaged = false;
  std::vector<std::size_t> sizes;
};

std::deque<WriteJob> lookups_beside_other_changes() {
  std::deque<WriteJob> jobs;
  jobs.push_back({1, AddWorker{1, "", 1, "", "", ""}, false});
  jobs.push_back({2, ReuseResults{1, nullptr, 0, "", nullptr}, true});
  jobs.push_back({3, ReuseResults{2, nullptr, 0, "", nullptr}, true});
  jobs.push_back({4, AddWorker{2, "", 1, "", "", ""}, false});
  return jobs;
}

TEST(GroupCommitTest, ALookupOfResultsIsTheLastChangeOfItsTransaction) {
  LookupStorage storage;
  GroupCommit commits(storage);
  auto jobs = lookups_beside_other_changes();
  while (!jobs.empty()) {
    commits.write(jobs);
  }
  EXPECT_EQ(storage.sizes, (std::vector<std::size_t>{2, 1, 1}));
}

TEST(GroupCommitTest, ALookupOfResultsThatFailsKeepsNothingElseFromBeingStored) {
  LookupStorage storage;
  storage.is_damaged = true;
  GroupCommit commits(storage);
  auto jobs = lookups_beside_other_changes();
  std::map<std::uint64_t, Kind> became;
  for (const auto& report : commits.write(jobs)) {
    became[report.ticket] = report.kind;
  }
  EXPECT_EQ(became,
            (std::map<std::uint64_t, Kind>{
                {1, Kind::kStored}, {2, Kind::kRefused}, {3, Kind::kRefused}, {4, Kind::kStored}}));
  EXPECT_TRUE(jobs.empty());
  EXPECT_FALSE(commits.is_faulty());
}

/// Takes changes until its files are gone; merges its log at the so-many-th try.
class VanishingStorage final : public Storage {
 public:
  void commit(std::span<const Change> changes) override {
    check();
    committed += changes.size();
    if (vanishes_in_commit) {
      gone = true;
      check();
    }
  }
  void check() override {
    if (gone) {
      throw StorageGone("the file was deleted");
    }
  }
  bool merge_log() override { return ++merges >= merged_at; }

  bool gone = false;
  bool vanishes_in_commit = false;
  std::size_t committed = 0;
  int merges = 0;
  int merged_at = 1;
};

std::vector<Kind> kinds_of(const std::vector<WriteReport>& reports) {
  std::vector<Kind> kinds;
  for (const auto& report : reports) {
    kinds.push_back(report.kind);
  }
  return kinds;
}

class VanishingTest : public testing::Test {
 protected:
  static std::deque<WriteJob> some_jobs() {
    std::deque<WriteJob> jobs;
    jobs.push_back({1, AddWorker{1, "", 1, "", "", ""}, false});
    jobs.push_back({2, SetStudyState{1, StudyState::kDone, ""}, true});
    return jobs;
  }

  VanishingStorage storage_;
  GroupCommit commits_{storage_};
};

TEST_F(VanishingTest, NothingIsReportedStoredThatWasCommittedToFilesThatAreGone) {
  storage_.vanishes_in_commit = true;
  auto jobs = some_jobs();
  EXPECT_EQ(kinds_of(commits_.write(jobs)), std::vector<Kind>{Kind::kGone});
  EXPECT_EQ(storage_.committed, 2U) << "both in one transaction";
  EXPECT_EQ(jobs.size(), 2U) << "they count as lost";
  EXPECT_EQ(kinds_of(commits_.write(jobs)), std::vector<Kind>{}) << "said once, never tried again";
  EXPECT_EQ(storage_.committed, 2U);
}

TEST_F(VanishingTest, FilesThatAreGoneAreNoticedWhileNothingIsWritten) {
  EXPECT_EQ(kinds_of(commits_.tend()), std::vector<Kind>{});
  storage_.gone = true;
  EXPECT_EQ(kinds_of(commits_.tend()), std::vector<Kind>{Kind::kGone});
  EXPECT_TRUE(commits_.is_gone());
  EXPECT_EQ(kinds_of(commits_.tend()), std::vector<Kind>{});
}

TEST_F(VanishingTest, TheLogIsMergedWhenAStudyIsDoneAsSoonAsReadersLetIt) {
  commits_.tend();
  EXPECT_EQ(storage_.merges, 0) << "no study has ended";
  auto jobs = some_jobs();
  commits_.write(jobs);
  storage_.merged_at = 8;
  std::vector<Kind> told;
  for (int i = 0; i < 20; ++i) {
    for (const Kind kind : kinds_of(commits_.tend())) {
      told.push_back(kind);
    }
  }
  EXPECT_EQ(storage_.merges, 8);
  EXPECT_EQ(told, std::vector<Kind>{Kind::kUnmerged}) << "said once";
}

TEST_F(WriterTest, AnEndMergesTheLogAndSaysWhenReadersKeepIt) {
  for (const bool readers_stay : {false, true}) {
    VanishingStorage storage;
    storage.merged_at = readers_stay ? 1'000'000 : 3;
    Reports reports;
    Writer writer(storage, [&](const std::vector<WriteReport>& r) { reports.take(r); });
    writer.submit(kept(1));
    EXPECT_EQ(writer.finish(), 0U);
    EXPECT_GE(storage.merges, 3);
    EXPECT_EQ(reports.count(Kind::kUnmerged), readers_stay ? 1 : 0);
  }
}

TEST_F(WriterTest, FinishingSaysHowManyChangesWereNotMadeDurable) {
  storage_.set_full(true);
  writer_.submit(kept(1));
  writer_.submit(kept(2));
  EXPECT_EQ(writer_.finish(), 2U);
}

TEST_F(WriterTest, WhatDeletedStudiesLeftIsClearedAwayBetweenWritesAndWithoutAny) {
  writer_.submit(kept(1));
  ASSERT_EQ(reports_.wait_for_ticket(1), Kind::kStored);
  constexpr int kSteps = 300;
  storage_.leave(kSteps);
  writer_.submit({2, DeleteStudy{7}, true});
  ASSERT_EQ(reports_.wait_for_ticket(2), Kind::kStored);
  for (std::uint64_t ticket = 3; storage_.left() > 0; ++ticket) {
    writer_.submit(kept(ticket));
    EXPECT_EQ(reports_.wait_for_ticket(ticket), Kind::kStored) << "written meanwhile";
  }
  EXPECT_EQ(writer_.finish(), 0U);
}

TEST_F(WriterTest, WhatAnEarlierProcessLeftIsClearedAwayWhenItIsTold) {
  storage_.leave(3);
  writer_.submit(kept(1));
  ASSERT_EQ(reports_.wait_for_ticket(1), Kind::kStored);
  EXPECT_EQ(storage_.left(), 3) << "others may still use the storage";
  writer_.resume_deletions();
  while (storage_.left() > 0) {
    std::this_thread::yield();
  }
}

TEST(GroupCommitTest, AStepThatFailsIsTakenAgainAndDisturbsNothing) {
  FailingStorage storage;
  GroupCommit commits(storage);
  EXPECT_FALSE(commits.has_to_clear()) << "not before it is told";
  commits.resume_deletions();
  storage.leave(2);
  std::vector<WriteReport> reports;
  EXPECT_TRUE(commits.clear(10, reports));
  storage.set_full(true);
  EXPECT_FALSE(commits.clear(10, reports));
  EXPECT_TRUE(commits.has_to_clear());
  storage.set_full(false);
  EXPECT_TRUE(commits.clear(10, reports));
  EXPECT_TRUE(commits.clear(10, reports));
  EXPECT_FALSE(commits.has_to_clear());
  EXPECT_TRUE(reports.empty());
}

}  // namespace
}  // namespace oblique::server
