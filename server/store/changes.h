#pragma once

#include <cstddef>
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

/// Returns the text for the column `studies.state`.
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

// Changes to the database. Times are UTC in ISO 8601. A change with `kNeedsFullSync` must survive a
// power failure. Other changes may be lost then, because they can be made again.

struct AddStudy {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
  std::string name;
  StudyTable table;
  std::string created_at;
  std::int32_t priority = 0;
  std::string submitted_by = {};  ///< name of the submitter's key; empty without keys
  bool reuses = false;            ///< true if results of other studies are to be reused
  std::string uid = {};           ///< random; different in each copy of the database
};

struct SetPriority {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
  std::int32_t priority = 0;
};

/// Deletes the rows of the failed points among `points`. A done study runs again.
struct ForgetFailures {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
  IntervalSet points;
  std::string changed_at;
};

struct SetStudyState {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
  StudyState state;
  std::string changed_at;
};

struct AddWorker {
  static constexpr bool kNeedsFullSync = false;
  static constexpr std::uint64_t study_id = 0;  ///< 0, because a worker belongs to no study
  std::uint64_t worker_id;
  std::string name;
  std::uint32_t threads;
  std::string solver_version;
  std::string instruction_set;
  std::string joined_at;
};

/// Adds results of one study. If a point already has a row, its new result is ignored.
struct AddResults {
  static constexpr bool kNeedsFullSync = false;
  std::uint64_t study_id;
  std::shared_ptr<const protocol::PointTable> table;
  std::uint64_t worker_id;  ///< 0 if the server itself failed the points
  std::string solver_version;
  std::string instruction_set;
  std::uint32_t attempt;
  std::string solved_at;
  std::vector<protocol::PointResult> results;
  IntervalSet left_out{};         ///< completed points that get no row
  std::size_t message_bytes = 0;  ///< size of the worker's message [bytes]
};

/// Appends points to a study. The study then runs with the given priority.
struct GrowStudy {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
  StudyTable table;  ///< all points of the study, including the earlier ones
  std::int32_t priority = 0;
  std::string changed_at;
  bool reuses = false;  ///< true if results of other studies are to be reused
};

/// Outcome of a ReuseResults change. It is valid as soon as the change is durable.
struct ReusedResults {
  IntervalSet points;                              ///< points that got a row
  std::map<std::string, std::uint64_t> origins{};  ///< number of copied rows, by source study
  std::uint64_t probes = 0;                        ///< number of lookups
  /// first point of the next part; nothing if the lookup is complete
  std::optional<std::uint64_t> next_point = {};
};

/// Looks up one part of the study's open points, from `first_point` on, in the results of other
/// studies, and copies the rows that it finds. A row must be of `solver_version`. Its study and
/// this study must both request estimated errors, or neither.
struct ReuseResults {
  static constexpr bool kNeedsFullSync = false;
  std::uint64_t study_id;
  std::shared_ptr<const protocol::PointTable> table;
  std::uint64_t first_point;
  std::string solver_version;
  std::shared_ptr<ReusedResults> outcome;  ///< set when the change has been written
};

/// Records that the lookup of results for a study has ended.
struct EndReuse {
  static constexpr bool kNeedsFullSync = false;
  std::uint64_t study_id;
};

struct RenameStudy {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
  std::string name;
};

/// Deletes a study and frees its name. The database then ignores results that arrive for the study.
/// `Storage::clear_away` later deletes its rows in parts.
struct DeleteStudy {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
};

using Change =
    std::variant<AddStudy, SetStudyState, SetPriority, ForgetFailures, GrowStudy, RenameStudy,
                 DeleteStudy, ReuseResults, EndReuse, AddWorker, AddResults>;

inline std::uint64_t study_of(const Change& change) {
  return std::visit([](const auto& kind) { return kind.study_id; }, change);
}

/// Returns the size of the message or recipe in a change [bytes]; 0 if it has none.
inline std::size_t bytes_of(const Change& change) {
  return std::visit(
      [](const auto& kind) -> std::size_t {
        if constexpr (requires { kind.message_bytes; }) {
          return kind.message_bytes;
        } else if constexpr (requires { kind.table.recipe_bytes(); }) {
          return kind.table.recipe_bytes().size();
        } else {
          return 0;
        }
      },
      change);
}

inline bool needs_full_sync(const Change& change) {
  return std::visit([](const auto& kind) { return kind.kNeedsFullSync; }, change);
}

/// Outcome of one step that deletes rows of deleted studies.
enum class ClearedAway {
  kAll,   ///< no rows of deleted studies are left
  kPart,  ///< more rows may be left
  /// no row was deleted, because readers keep the write-ahead log from shrinking; try again later
  kMustWait,
};

/// Interface of the writer to the database. Tests replace it.
class Storage {
 public:
  virtual ~Storage() = default;

  /// Writes all changes, in order, in one durable transaction. Throws StorageError if no change was
  /// stored. Throws StorageGone if it is unknown whether they were stored; nothing can be stored
  /// after that.
  virtual void commit(std::span<const Change> changes) = 0;

  /// Throws StorageGone if the file at the database's path was deleted or replaced.
  virtual void check() {}

  /// Deletes at most `most` rows of deleted studies in one transaction. Throws `commit`'s errors.
  virtual ClearedAway clear_away(std::size_t /*most*/) { return ClearedAway::kAll; }

  /// Moves the write-ahead log into the database and empties it, so that one file contains
  /// everything. Returns false if a reader prevents that. Throws StorageError.
  virtual bool merge_log() { return true; }

  /// Makes the running statement, and every later statement that takes long, fail with a
  /// StorageError. Thread-safe.
  virtual void interrupt() {}
};

}  // namespace oblique::server
