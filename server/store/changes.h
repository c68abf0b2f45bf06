#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "server/study/interval_set.h"
#include "server/study/study_table.h"

namespace oblique::server {

enum class StudyState { kRunning, kPaused, kCancelled, kDone };
inline constexpr std::size_t kStudyStates = 4;

/// The text in the column `studies.state`.
constexpr const char* state_name(StudyState state) {
  switch (state) {
    case StudyState::kRunning:
      return "running";
    case StudyState::kPaused:
      return "paused";
    case StudyState::kDone:
      return "done";
    case StudyState::kCancelled:
      return "cancelled";
  }
  return "";
}

// Changes of the database. Instants are UTC in ISO 8601.

struct AddStudy {
  std::uint64_t study_id;
  std::string name;
  StudyTable table;
  std::string created_at;
  std::int32_t priority = 0;
  std::string submitted_by = {};  ///< name of the key; empty: without keys
  bool takes_over = false;        ///< results of other studies are looked up
};

struct SetPriority {
  std::uint64_t study_id;
  std::int32_t priority = 0;
};

/// Deletes the rows of these points that failed. A study that was done runs again.
struct ForgetFailures {
  std::uint64_t study_id;
  IntervalSet points;
  std::string changed_at;
};

struct SetStudyState {
  std::uint64_t study_id;
  StudyState state;
  std::string changed_at;
};

struct AddWorker {
  std::uint64_t worker_id;
  std::string name;
  std::uint32_t threads;
  std::string solver_version;
  std::string instruction_set;
  std::string joined_at;
};

/// Results of one study. A point that has a row already keeps it.
struct AddResults {
  std::uint64_t study_id;
  std::shared_ptr<const protocol::PointTable> table;
  std::uint64_t worker_id;  ///< 0: the server itself failed the points
  std::string solver_version;
  std::string instruction_set;
  std::uint32_t attempt;
  std::string solved_at;
  std::vector<protocol::PointResult> results;
};

/// Appends points to a study, which then runs with this priority.
struct GrowStudy {
  std::uint64_t study_id;
  StudyTable table;  ///< of all its points
  std::int32_t priority = 0;
  std::string changed_at;
  bool takes_over = false;  ///< as in AddStudy
};

/// The outcome of a ReuseResults, valid once the change is durable.
struct ReusedResults {
  IntervalSet points;                              ///< that got a row
  std::map<std::string, std::uint64_t> origins{};  ///< number of copies by the name of their study
  std::uint64_t probes = 0;                        ///< number of lookups
  std::optional<std::uint64_t> next_point = {};    ///< first point of the next part; none: the end
};

/// Looks up one part of the study's open points, from `first_point` on, among the solved points of
/// other studies, and copies the rows that it finds. They must be of that solver version, and both
/// studies must ask for estimated errors or neither.
struct ReuseResults {
  std::uint64_t study_id;
  std::shared_ptr<const protocol::PointTable> table;
  std::uint64_t first_point;
  std::string solver_version;
  std::shared_ptr<ReusedResults> outcome;  ///< is filled in
};

/// Ends the lookup of results for a study.
struct EndTaking {
  std::uint64_t study_id;
};

struct RenameStudy {
  std::uint64_t study_id;
  std::string name;
};

/// Deletes a study. Its name is free, and later results of it are dropped. Its rows are deleted in
/// parts by `Storage::clear_away`.
struct DeleteStudy {
  std::uint64_t study_id;
};

using Change =
    std::variant<AddStudy, SetStudyState, SetPriority, ForgetFailures, GrowStudy, RenameStudy,
                 DeleteStudy, ReuseResults, EndTaking, AddWorker, AddResults>;

/// Which rows of deleted studies a step deleted.
enum class ClearedAway {
  kAll,       ///< none are left
  kPart,      ///< some may be left
  kMustWait,  ///< none, because readers keep the write-ahead log long; try later
};

/// The database as the writer sees it. Tests replace it by one that fails.
class Storage {
 public:
  virtual ~Storage() = default;

  /// Makes all changes durable, in order, in one transaction. Throws StorageError if none of them
  /// was kept, and StorageGone if that is unknown: nothing can be stored any more.
  virtual void commit(std::span<const Change> changes) = 0;

  /// Throws StorageGone when another file, or none, is at the path of the database.
  virtual void check() {}

  /// Deletes at most so many rows of deleted studies in one transaction. Throws as `commit` does.
  virtual ClearedAway clear_away(std::size_t /*most*/) { return ClearedAway::kAll; }

  /// Moves the write-ahead log into the database and empties it, so that the one file holds all.
  /// False when a reader prevents it. Throws StorageError.
  virtual bool merge_log() { return true; }

  /// Ends the current statement, and every later one that takes long, with a StorageError. From any
  /// thread.
  virtual void interrupt() {}
};

}  // namespace oblique::server
