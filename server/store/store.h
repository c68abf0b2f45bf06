#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/database/sqlite.h"
#include "server/store/changes.h"
#include "server/store/database_files.h"
#include "server/store/result_reuse.h"
#include "server/store/rows/settled_runs.h"
#include "server/store/study_deletion.h"
#include "server/store/write_ahead_log.h"
#include "server/study/interval_set.h"
#include "server/study/point_attempts.h"

namespace oblique::server {

/// A study as the database has it.
struct StoredStudy {
  std::uint64_t study_id;
  std::string name;
  StudyTable table;
  StudyState state;
  std::string created_at;
  StudyTerms terms{};
  std::string solver_version;  ///< of its first result that a worker solved; empty: there is none
  IntervalSet settled;         ///< points that have a row or are left out
  IntervalSet failures;        ///< those whose row says failed
  PointAttempts attempts{};    ///< of these, and of those that failed and were forgotten
  std::string submitted_by{};  ///< name of the key; empty: without keys
  bool takes_over = false;     ///< points that other studies have solved are still sought
  std::uint64_t left_out = 0;  ///< how many of the settled points a filter leaves out
  std::map<std::string, std::uint64_t> taken{};  ///< points that it took over, by their origins
};

/// The SQLite database (schema.sql), opened for writing. Only one Store may have a file open;
/// readers are free. A new file is for its owner alone (mode 0600). Results are committed without
/// waiting for the disk's own cache (losing power may undo the last ones, which are then solved
/// again), studies with a full sync.
class Store final : public Storage {
 public:
  /// Opens the database at `path`, or makes it. Throws StorageError naming what was found: a
  /// directory, a foreign file, another schema, a damaged or unwritable file, one that is open
  /// elsewhere.
  explicit Store(const std::string& path);
  ~Store() override;

  void commit(std::span<const Change> changes) override;
  void check() override { files_->check(); }
  bool merge_log() override;
  void interrupt() override { interrupted_ = true; }
  ClearedAway clear_away(std::size_t most) override;
  /// Rows that `clear_away` has deleted.
  std::uint64_t cleared_rows() const { return deletion_->rows(); }

  /// There was no file; it was made.
  bool is_new() const { return files_->were_made(); }

  /// The log is moved into the database when it has so many pages; 1000 unless told.
  void checkpoint_at(int pages) { log_->shorten_at(pages); }

  /// All studies in the order of their numbers, with what is settled. Rows of those that are in
  /// doubt (SettledRuns) are counted again. Throws StorageError, also for a recipe that cannot be
  /// read, a number below 1, and a study whose rows are not those of its recipe.
  std::vector<StoredStudy> studies();
  /// A sentence about each study that `studies` left out, because an earlier version took what this
  /// one does not.
  const std::vector<std::string>& left_out() const { return left_out_; }

  /// Highest number given to a study or worker so far, in any table; 0 when there is none. Throws
  /// StorageError when no study can have a higher one.
  std::uint64_t last_study_id();
  std::uint64_t last_worker_id();

  /// To be called once, when a server begins to work: counts it, durably. Returns how many began so
  /// far, this one included.
  std::uint64_t count_start();

  /// Drawn at random when the file was made.
  std::string database_id();

 private:
  struct Statements;

  void add(const AddStudy& change);
  void add(const SetStudyState& change);
  void add(const SetStudyTerms& change);
  void add(const ForgetFailures& change);
  void add(const GrowStudy& change);
  void add(const RenameStudy& change);
  void add(const DeleteStudy& change);
  void add(const ReuseResults& change) { reuse_->run(change); }
  void add(const EndTaking& change) { reuse_->end(change); }
  void add(const AddWorker& change);
  void add(const AddResults& change);
  /// Row of `models`, and the accuracy of its results.
  struct StoredModel {
    std::int64_t id;
    double accuracy;
  };
  bool has_study(std::uint64_t study_id);
  StoredModel stored_model(const AddResults& change, std::uint64_t model);
  std::int64_t known_model(std::string_view definition);
  void set_sync(bool full);
  std::uint64_t highest(const std::string& sql);
  PointsOfStudies settled_points();

  std::unique_ptr<DatabaseFiles> files_;   // outlives the connection
  std::atomic<bool> interrupted_ = false;  // the same
  DatabaseHandle database_;
  std::unique_ptr<WriteAheadLog> log_;
  std::unique_ptr<StudyDeletion> deletion_;
  std::unique_ptr<Statements> statements_;
  std::unique_ptr<SettledRuns> settled_;
  std::unique_ptr<ResultReuse> reuse_;
  // By study and model number; emptied when it is large or a transaction fails.
  std::map<std::pair<std::uint64_t, std::uint64_t>, StoredModel> models_;
  bool full_sync_ = true;
  std::vector<std::string> left_out_;
};

}  // namespace oblique::server
