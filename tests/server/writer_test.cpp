#include "server/writer.h"

#include <condition_variable>
#include <map>
#include <mutex>

#include <gtest/gtest.h>

#include "server/sqlite.h"

namespace oblique::server {
namespace {

using Kind = WriteReport::Kind;

/// A disk that fails when it is told to, and that remembers what was committed.
class FailingStorage final : public Storage {
 public:
  void commit(std::span<const Change> changes) override {
    const std::lock_guard lock(mutex_);
    ++attempts_;
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

  static constexpr std::uint64_t kBad = 666;  // a change of this study always fails

  void set_full(bool full) {
    const std::lock_guard lock(mutex_);
    full_ = full;
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
  int attempts_ = 0;
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

TEST_F(WriterTest, FinishingSaysHowManyChangesWereNotMadeDurable) {
  storage_.set_full(true);
  writer_.submit(kept(1));
  writer_.submit(kept(2));
  EXPECT_EQ(writer_.finish(), 2U);
}

}  // namespace
}  // namespace oblique::server
