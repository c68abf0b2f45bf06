#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/database/sqlite.h"
#include "server/store/changes.h"

namespace oblique::server {

/// Counts observed values in bins. Not thread-safe.
class Histogram {
 public:
  /// `bounds` must ascend. Each is the largest value of its bin. One more bin counts larger values.
  explicit Histogram(std::vector<double> bounds)
      : bounds_(std::move(bounds)), counts_(bounds_.size() + 1) {}

  void observe(double amount) {
    const auto at = std::lower_bound(bounds_.begin(), bounds_.end(), amount) - bounds_.begin();
    ++counts_[static_cast<std::size_t>(at)];
    sum_ += amount;
  }

  const std::vector<double>& bounds() const { return bounds_; }
  /// Returns the number of values in each bin. There is one more bin than bounds.
  const std::vector<std::uint64_t>& counts() const { return counts_; }
  double sum() const { return sum_; }

 private:
  std::vector<double> bounds_;
  std::vector<std::uint64_t> counts_;
  double sum_ = 0.0;
};

struct WriteJob {
  std::uint64_t ticket;
  Change change;
  /// If true, a failure is reported at once, because a client waits. If false, the change is
  /// repeated until it succeeds.
  bool answer_failure;
};

/// The outcome of a job, or a change in what the database accepts.
struct WriteReport {
  enum class Kind {
    kStored,     ///< the job is durable
    kRefused,    ///< the job failed and was dropped; `error` has the reason
    kFault,      ///< the database accepts no changes and jobs wait; reported once
    kRecovered,  ///< the database accepts changes again
    /// the file is gone or damaged, a sync failed, or a result contradicts the file, so nothing
    /// more is written; reported once
    kGone,
    /// the log cannot be merged, see `error`; reported once per finished study and at the end
    kUnmerged,
  };
  Kind kind;
  std::uint64_t ticket = 0;
  std::string error;
};

/// Counts of commits since the writer began.
struct CommitCounts {
  Histogram duration_s{{0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0}};
  /// number of results
  Histogram rows{{1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0, 16'384.0, 65'536.0}};
};

/// Writes jobs in groups, each group in one transaction. Has no thread or clock.
class GroupCommit {
 public:
  /// `storage` must outlive this object.
  explicit GroupCommit(Storage& storage) : storage_(storage) {}

  /// Writes the first jobs in one transaction and removes durable and refused jobs. If the
  /// transaction fails, each job gets a transaction of its own, so that one bad change does not
  /// block the others. Keeps the order of changes of one study.
  std::vector<WriteReport> write(std::deque<WriteJob>& jobs);

  /// Returns the number of results that are durable so far.
  std::uint64_t rows() const { return rows_; }
  /// Returns whether jobs wait because the database refused them in the last `write`.
  bool is_faulty() const { return faulty_; }
  /// Returns whether WriteReport::Kind::kGone was reported. Nothing more is written after that.
  bool is_gone() const { return gone_; }

  /// Must be called at a start, to continue the deletion of rows of deleted studies.
  void resume_deletions() { clears_ = true; }
  /// Returns whether rows of deleted studies may remain.
  bool has_to_clear() const { return clears_ && !gone_; }
  /// Deletes at most `most` rows of deleted studies. Returns false if the next call should wait.
  bool clear(std::size_t most, std::vector<WriteReport>& reports);

  /// Checks the file of the database. Merges the log after a study is done. Must be called
  /// regularly while no job waits.
  std::vector<WriteReport> maintain();

  /// Merges the log. Returns false if that failed; the caller must then check `is_gone` before
  /// another attempt.
  bool merge(std::vector<WriteReport>& reports);
  /// Returns the report of a failed `merge`.
  WriteReport unmerged() const { return {WriteReport::Kind::kUnmerged, 0, why_unmerged_}; }

 private:
  bool write_group(std::deque<WriteJob>& jobs, std::vector<WriteReport>& reports);
  void write_singly(std::deque<WriteJob>& jobs, std::vector<WriteReport>& reports);

  void note_committed(std::span<const Change> changes);
  void note_gone(const std::exception& error, std::vector<WriteReport>& reports);

  Storage& storage_;
  std::uint64_t rows_ = 0;
  bool faulty_ = false;
  bool gone_ = false;
  bool clears_ = false;        // true if rows of deleted studies may be left
  bool to_be_merged_ = false;  // true if a study is done, so that the log should be merged
  int tries_ = 0;              // number of failed attempts to merge since the study was done
  std::string why_unmerged_;
};

/// The thread that writes the database. Commits waiting jobs together, in order.
class Writer {
 public:
  using Report = std::function<void(std::vector<WriteReport>)>;

  /// `report` is called on the writer's thread after each commit. `storage` must outlive this
  /// object. `finish` interrupts a write, deletion or merge after `longest_last_step`.
  Writer(Storage& storage, Report report,
         std::chrono::milliseconds longest_last_step = std::chrono::seconds(5));
  /// Ends the thread. Does not wait for jobs that keep failing.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  void submit(WriteJob job);

  /// Continues deletions that an earlier process did not finish. After this call only the writer's
  /// thread may use the storage.
  void resume_deletions();

  /// Writes the waiting jobs, merges the log and ends the thread. Interrupts statements that take
  /// too long. Returns the number of jobs that were not stored.
  std::size_t finish();

  /// Thread-safe.
  CommitCounts commits() const;

 private:
  void run();
  std::vector<WriteReport> write(std::deque<WriteJob>& jobs);
  bool may_clear() const;
  void merge_before_the_end();

  Storage& storage_;
  const std::chrono::milliseconds longest_last_step_;
  GroupCommit commits_;  // used only by the thread
  Report report_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<WriteJob> queue_;  // guarded by mutex_
  bool finishing_ = false;      // guarded by mutex_
  bool resumes_ = false;        // guarded by mutex_
  std::uint64_t steps_ = 0;     // number of steps that the thread has started; guarded by mutex_
  bool has_ended_ = false;      // true after the thread has ended; guarded by mutex_
  std::condition_variable ended_;
  CommitCounts counts_;        // guarded by mutex_
  std::size_t left_over_ = 0;  // written by the thread, read after the thread has ended
  std::chrono::steady_clock::time_point clears_from_{};  // used only by the thread
  std::thread thread_;  // declared last, as it uses the other members
};

}  // namespace oblique::server
