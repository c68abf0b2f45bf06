#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/database/database_file.h"
#include "server/database/sqlite.h"
#include "server/store/changes.h"
#include "server/store/completed_ranges.h"
#include "server/store/result_rows.h"
#include "server/store/write_ahead_log.h"
#include "server/study/interval_set.h"

namespace oblique::server {

/// A study as read from the database.
struct StoredStudy {
  std::uint64_t study_id;
  std::string name;
  StudyTable table;
  StudyState state;
  std::string created_at;
  std::int32_t priority = 0;
  std::string solver_version;  ///< solver version of its results; empty without results
  IntervalSet completed;
  IntervalSet failures;        ///< completed points that failed
  std::string submitted_by{};  ///< name of the submitter's key; empty without keys
  bool reuses = false;         ///< true if the lookup of other studies' results has not ended
  std::uint64_t left_out = 0;  ///< number of completed points that the study's filter leaves out
  std::map<std::string, std::uint64_t> reused{};  ///< number of reused results by source study
  std::string uid{};                              ///< AddStudy.uid
};

/// The SQLite database (schema.sql), opened for writing. Only one Store can have a file open; other
/// programs can read the file. A new file has mode 0600. Results are committed without a sync, so a
/// power failure can undo the last results, which are then solved again. Other changes are synced.
class Store final : public Storage {
 public:
  /// Opens or creates the database at `path`. Throws StorageError if `path` is a directory, a file
  /// of another format or schema, a file that is damaged or cannot be written, or a file that
  /// another server has open.
  explicit Store(const std::string& path);
  ~Store() override;

  void commit(std::span<const Change> changes) override;
  void check() override { file_.check(); }
  bool merge_log() override;
  void interrupt() override { interrupted_ = true; }
  ClearedAway clear_away(std::size_t most) override;
  /// Returns the number of rows that `clear_away` has deleted.
  std::uint64_t cleared_rows() const { return cleared_rows_; }

  /// Runs `work` in a durable transaction; rolls back if `work` throws. Throws the errors of
  /// `commit`.
  void write(const std::function<void()>& work);
  /// Returns the connection, for programs that change the file without a server. Triggers are off.
  sqlite3* connection() const { return database_.get(); }

  /// Returns whether the file was created by this object.
  bool is_new() const { return file_.is_new(); }

  /// Sets the length of the write-ahead log [pages] above which it is copied into the database.
  void checkpoint_at(int pages) { log_->shorten_at(pages); }

  /// Returns all studies in the order of their numbers, with their completed points. Throws
  /// StorageError, also for a study whose number, recipe or size was changed after it was stored.
  std::vector<StoredStudy> studies();
  /// Returns a sentence about each study that `studies` skipped because this version refuses it.
  const std::vector<std::string>& skipped() const { return skipped_; }

  /// Return the highest study or worker number ever used; 0 if none was. Throw StorageError.
  std::uint64_t last_study_id();
  std::uint64_t last_worker_id();

  /// Increments the number of server starts in the database, durably, and returns it.
  std::uint64_t count_start();

  /// Returns the random text that was stored when the file was created.
  std::string database_id();

 private:
  struct Statements;

  void add(const AddStudy& change);
  void add(const SetStudyState& change);
  void add(const SetPriority& change);
  void add(const ForgetFailures& change);
  void add(const GrowStudy& change);
  void add(const RenameStudy& change);
  void add(const DeleteStudy& change);
  void add(const ReuseResults& change);
  void add(const EndReuse& change);
  void add(const AddWorker& change);
  void add(const AddResults& change);
  /// Runs `work` and sets `sync_failed_` if a sync fails.
  void guard_syncs(const std::function<void()>& work);
  void in_transaction(bool full_sync, const std::function<void()>& work);
  void remove_orphans();
  bool has_study(std::uint64_t study_id);
  std::int64_t stored_model(const AddResults& change, std::uint64_t model);
  std::uint64_t number(const std::string& sql);

  ServerFile file_;                        // declared first, because it must outlive the connection
  std::atomic<bool> interrupted_ = false;  // declared before the connection, which uses it
  DatabaseHandle database_;
  std::unique_ptr<WriteAheadLog> log_;
  std::unique_ptr<Statements> statements_;
  std::unique_ptr<CompletedRanges> ranges_;
  // Cache of row numbers of `models`, by study and model number. It is cleared when it becomes
  // large or a transaction fails.
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::int64_t> models_;
  std::uint64_t cleared_rows_ = 0;
  bool full_sync_ = true;
  bool sync_failed_ = false;
  std::vector<std::string> skipped_;
};

/// Prepared statements for batches of results.
struct Store::Statements {
  explicit Statements(sqlite3* database)
      : find_study(database, "SELECT 1 FROM studies WHERE study_id = ?"),
        models(database),
        add_result(database) {}

  Statement find_study;
  ModelRows models;
  ResultInsert add_result;
};

}  // namespace oblique::server
