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

/// Counts observed amounts by class of size. Not thread-safe.
class Histogram {
 public:
  /// `bounds` ascend. Each is the largest amount of its class; larger amounts are the last class.
  explicit Histogram(std::vector<double> bounds)
      : bounds_(std::move(bounds)), counts_(bounds_.size() + 1) {}

  void observe(double amount) {
    const auto at = std::lower_bound(bounds_.begin(), bounds_.end(), amount) - bounds_.begin();
    ++counts_[static_cast<std::size_t>(at)];
    sum_ += amount;
  }

  const std::vector<double>& bounds() const { return bounds_; }
  /// Number of amounts by class; there is one more class than bounds.
  const std::vector<std::uint64_t>& counts() const { return counts_; }
  double sum() const { return sum_; }

 private:
  std::vector<double> bounds_;
  std::vector<std::uint64_t> counts_;
  double sum_ = 0.0;
};

/// A change that waits to be written.
struct WriteJob {
  std::uint64_t ticket;
  Change change;
  /// Whether a failure is reported at once, because a client waits for the answer. Otherwise the
  /// change is tried again until it is durable.
  bool answer_failure;
};

/// The outcome of a job, or a change of the state of the database.
struct WriteReport {
  enum class Kind {
    kStored,     ///< the job with this ticket is durable
    kRefused,    ///< the job failed and was dropped; `error` says why
    kFault,      ///< the database accepts no changes; jobs wait. Reported once
    kRecovered,  ///< it accepts changes again
    kGone,       ///< the file is gone or a sync failed; nothing more is written. Reported once
    kUnmerged,  ///< the log cannot be merged; `error` says why. Once per finished study, and at the
                ///< end
  };
  Kind kind;
  std::uint64_t ticket = 0;
  std::string error;
};

/// Counts of commits since the writer began.
struct CommitCounts {
  Histogram duration_s{{0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0}};
  Histogram rows{{1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0, 16'384.0, 65'536.0}};  ///< results
};

/// Writes jobs in groups, one transaction each. It has no thread or clock of its own.
class GroupCommit {
 public:
  /// `storage` must outlive this.
  explicit GroupCommit(Storage& storage) : storage_(storage) {}

  /// Writes the first jobs as one transaction and removes those that are durable or refused. If the
  /// transaction fails, each job gets its own, so that one bad change does not block the others.
  /// Changes of one study keep their order.
  std::vector<WriteReport> write(std::deque<WriteJob>& jobs);

  /// Number of results that this object has made durable.
  std::uint64_t rows() const { return rows_; }
  /// Whether the last write left jobs that the database did not accept.
  bool is_faulty() const { return faulty_; }
  /// Whether nothing is written any more, as after WriteReport::Kind::kGone.
  bool is_gone() const { return gone_; }

  /// To be called at a start: an earlier process may have left rows of deleted studies.
  void resume_deletions() { clears_ = true; }
  /// Whether rows of deleted studies may be left.
  bool has_to_clear() const { return clears_ && !gone_; }
  /// Deletes at most `most` of these rows. False when the next call should wait.
  bool clear(std::size_t most, std::vector<WriteReport>& reports);

  /// To be called regularly while no job waits: checks the file of the database, and merges its log
  /// once a study is done.
  std::vector<WriteReport> maintain();

  /// Merges the log. False when it was not merged; check `is_gone` before another attempt.
  bool merge(std::vector<WriteReport>& reports);
  /// A report that the last `merge` failed.
  WriteReport unmerged() const { return {WriteReport::Kind::kUnmerged, 0, why_unmerged_}; }

 private:
  bool write_group(std::deque<WriteJob>& jobs, std::vector<WriteReport>& reports);
  void write_singly(std::deque<WriteJob>& jobs, std::vector<WriteReport>& reports);

  void note_committed(std::span<const Change> changes);
  void note_gone(const StorageGone& error, std::vector<WriteReport>& reports);

  Storage& storage_;
  std::uint64_t rows_ = 0;
  bool faulty_ = false;
  bool gone_ = false;
  bool clears_ = false;        // rows of deleted studies may be left
  bool to_be_merged_ = false;  // a study is done
  int tries_ = 0;              // attempts to merge since then
  std::string why_unmerged_;
};

/// The thread that writes the database. Jobs that wait are committed together, in order.
class Writer {
 public:
  using Report = std::function<void(std::vector<WriteReport>)>;

  /// `report` is called on the writer's thread, after each commit. `storage` must outlive the
  /// writer. `finish` interrupts a step that takes longer than `longest_last_step`.
  Writer(Storage& storage, Report report,
         std::chrono::milliseconds longest_last_step = std::chrono::seconds(5));
  /// Stops without waiting for jobs that keep failing.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  void submit(WriteJob job);

  /// Continues deletions that an earlier process left. To be called when no other thread uses the
  /// storage any more.
  void resume_deletions();

  /// Writes the waiting jobs, merges the log and ends the thread; interrupts statements that take
  /// too long. Returns the number of jobs that could not be made durable.
  std::size_t finish();

  /// May be called from any thread.
  CommitCounts commits() const;

 private:
  void run();
  std::vector<WriteReport> write(std::deque<WriteJob>& jobs);
  bool may_clear() const;
  void merge_before_the_end();

  Storage& storage_;
  const std::chrono::milliseconds longest_last_step_;
  GroupCommit commits_;  // used by the thread only
  Report report_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<WriteJob> queue_;  // guarded by mutex_
  bool finishing_ = false;      // guarded by mutex_
  bool resumes_ = false;        // guarded by mutex_
  std::uint64_t steps_ = 0;     // steps begun by the thread; guarded by mutex_
  bool has_ended_ = false;      // the thread has ended; guarded by mutex_
  std::condition_variable ended_;
  CommitCounts counts_;        // guarded by mutex_
  std::size_t left_over_ = 0;  // written by the thread, read after it ended
  std::chrono::steady_clock::time_point clears_from_{};  // used by the thread only
  std::thread thread_;                                   // last: it uses the other members
};

}  // namespace oblique::server
