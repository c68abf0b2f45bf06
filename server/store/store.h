#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/database/sqlite.h"
#include "server/store/changes.h"
#include "server/store/completed_ranges.h"
#include "server/store/database_files.h"
#include "server/store/result_reuse.h"
#include "server/store/study_deletion.h"
#include "server/store/write_ahead_log.h"
#include "server/study/interval_set.h"
#include "server/study/point_attempts.h"

namespace oblique::server {

/// A study as read from the database.
struct StoredStudy {
  std::uint64_t study_id;
  std::string name;
  StudyTable table;
  StudyState state;
  std::string created_at;
  std::int32_t priority = 0;
  std::string solver_version;  ///< of its results; empty: there are none
  IntervalSet settled;         ///< completed points
  IntervalSet failures;        ///< completed points that failed
  PointAttempts attempts{};    ///< of failed points, and of those whose failure `retry` removed
  std::string submitted_by{};  ///< name of the key; empty: without keys
  bool reuses = false;         ///< the lookup of results in other studies has not ended
  std::uint64_t left_out = 0;  ///< number of completed points that `where` leaves out
  std::map<std::string, std::uint64_t> taken{};  ///< number of reused results by source study
};

/// The SQLite database (schema.sql), opened for writing. Only one Store can have a file open; other
/// programs can read it. A new file has mode 0600. Results are committed without a sync, so a loss
/// of power can undo the last ones, which are then solved again; other changes are synced.
class Store final : public Storage {
 public:
  /// Opens the database at `path`, or creates it. Throws StorageError for a directory, for a file
  /// that has another format or schema, is damaged or cannot be written, and for one that another
  /// server has open.
  explicit Store(const std::string& path);
  ~Store() override;

  void commit(std::span<const Change> changes) override;
  void check() override { files_->check(); }
  bool merge_log() override;
  void interrupt() override { interrupted_ = true; }
  ClearedAway clear_away(std::size_t most) override;
  /// Number of rows that `clear_away` has deleted.
  std::uint64_t cleared_rows() const { return deletion_->rows(); }

  /// Whether the file was created.
  bool is_new() const { return files_->were_made(); }

  /// Sets the length of the write-ahead log [pages] from which on it is copied into the database.
  void checkpoint_at(int pages) { log_->shorten_at(pages); }

  /// All studies in the order of their numbers, with their completed points. Rows are counted again
  /// where another program deleted some. Throws StorageError, also for a recipe that cannot be
  /// read, a number below 1, and a study whose rows are not those of its recipe.
  std::vector<StoredStudy> studies();
  /// A sentence about each study that `studies` skipped because this version does not accept it.
  const std::vector<std::string>& left_out() const { return left_out_; }

  /// Highest number given to a study or worker so far, in any table; 0 when there is none. Throws
  /// StorageError when no study can have a higher one.
  std::uint64_t last_study_id();
  std::uint64_t last_worker_id();

  /// Adds a start of a server to the count, durably. Returns the number of starts, this one
  /// included.
  std::uint64_t count_start();

  /// A random text that was set when the file was created.
  std::string database_id();

 private:
  struct Statements;

  void add(const AddStudy& change);
  void add(const SetStudyState& change);
  void add(const SetPriority& change);
  void add(const ForgetFailures& change);
  void add(const GrowStudy& change);
  void add(const RenameStudy& change);
  void add(const DeleteStudy& change) { deletion_->remove(change.study_id); }
  void add(const ReuseResults& change) { reuse_->run(change); }
  void add(const EndReuse& change) { reuse_->end(change); }
  void add(const AddWorker& change);
  void add(const AddResults& change);
  void prepare_schema(const std::string& path);
  /// Runs `work` and records a failed sync.
  void guard_syncs(const std::function<void()>& work);
  /// Runs `work` in a transaction that is rolled back if `work` throws.
  void in_transaction(bool full_sync, const std::function<void()>& work);
  bool has_study(std::uint64_t study_id);
  std::int64_t stored_model(const AddResults& change, std::uint64_t model);
  std::uint64_t highest(const std::string& sql);
  PointsOfStudies completed_points();

  std::unique_ptr<DatabaseFiles> files_;   // must outlive the connection
  std::atomic<bool> interrupted_ = false;  // must outlive the connection
  DatabaseHandle database_;
  std::unique_ptr<WriteAheadLog> log_;
  std::unique_ptr<StudyDeletion> deletion_;
  std::unique_ptr<Statements> statements_;
  std::unique_ptr<CompletedRanges> ranges_;
  std::unique_ptr<ResultReuse> reuse_;
  // Cache: rows of `models` by study and model number. Cleared when large or a transaction fails.
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::int64_t> models_;
  bool full_sync_ = true;
  bool sync_failed_ = false;
  std::vector<std::string> left_out_;
};

}  // namespace oblique::server
