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

// Changes of the database. Instants are UTC in ISO 8601. `kNeedsFullSync`: the change must survive
// a loss of power. Results need not, because they can be solved again.

struct AddStudy {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
  std::string name;
  StudyTable table;
  std::string created_at;
  std::int32_t priority = 0;
  std::string submitted_by = {};  ///< name of the key; empty: without keys
  bool reuses = false;            ///< look up results of other studies
};

struct SetPriority {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
  std::int32_t priority = 0;
};

/// Deletes the rows of the failed ones among these points. A study that was done runs again.
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
  static constexpr std::uint64_t study_id = 0;  ///< of no study
  std::uint64_t worker_id;
  std::string name;
  std::uint32_t threads;
  std::string solver_version;
  std::string instruction_set;
  std::string joined_at;
};

/// Adds results of one study. A point that has a row already keeps it.
struct AddResults {
  static constexpr bool kNeedsFullSync = false;
  std::uint64_t study_id;
  std::shared_ptr<const protocol::PointTable> table;
  std::uint64_t worker_id;  ///< 0: the server itself failed the points
  std::string solver_version;
  std::string instruction_set;
  std::uint32_t attempt;
  std::string solved_at;
  std::vector<protocol::PointResult> results;
  IntervalSet left_out{};         ///< points that the filter leaves out: completed without a row
  std::size_t message_bytes = 0;  ///< of the worker's message
};

/// Appends points to a study, which then runs with this priority.
struct GrowStudy {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
  StudyTable table;  ///< all points, the earlier ones included
  std::int32_t priority = 0;
  std::string changed_at;
  bool reuses = false;  ///< as in AddStudy
};

/// The outcome of a ReuseResults, valid once the change is durable.
struct ReusedResults {
  IntervalSet points;                              ///< points that got a row
  std::map<std::string, std::uint64_t> origins{};  ///< number of copies by name of the source study
  std::uint64_t probes = 0;                        ///< number of lookups
  std::optional<std::uint64_t> next_point = {};    ///< first point of the next part; none: end
};

/// Looks up one part of the study's open points, from `first_point` on, among the solved points of
/// other studies, and copies the rows that it finds. A row is copied only if it is of
/// `solver_version` and both studies request estimated errors or neither does.
struct ReuseResults {
  static constexpr bool kNeedsFullSync = false;
  std::uint64_t study_id;
  std::shared_ptr<const protocol::PointTable> table;
  std::uint64_t first_point;
  std::string solver_version;
  std::shared_ptr<ReusedResults> outcome;  ///< set when the change is written
};

/// Ends the lookup of results for a study.
struct EndReuse {
  static constexpr bool kNeedsFullSync = false;
  std::uint64_t study_id;
};

struct RenameStudy {
  static constexpr bool kNeedsFullSync = true;
  std::uint64_t study_id;
  std::string name;
};

/// Deletes a study: its name becomes free, and later results of it are dropped. Its rows are
/// deleted in parts by `Storage::clear_away`.
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

/// Size of the message or recipe in a change that has one.
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

/// The outcome of one step of deleting the rows of deleted studies.
enum class ClearedAway {
  kAll,       ///< no such row is left
  kPart,      ///< more rows may be left
  kMustWait,  ///< nothing was deleted, because readers keep the write-ahead log long; try later
};

/// The database as the writer uses it. Tests replace it by one that fails.
class Storage {
 public:
  virtual ~Storage() = default;

  /// Writes all changes, in order, in one transaction, and makes it durable. Throws StorageError if
  /// none was stored, and StorageGone if that is unknown: nothing can be stored any more.
  virtual void commit(std::span<const Change> changes) = 0;

  /// Throws StorageGone when the file at the path of the database was deleted or replaced.
  virtual void check() {}

  /// Deletes at most `most` rows of deleted studies in one transaction. Throws as `commit` does.
  virtual ClearedAway clear_away(std::size_t /*most*/) { return ClearedAway::kAll; }

  /// Moves the write-ahead log into the database and empties it, so that this one file holds
  /// everything. False when a reader prevents it. Throws StorageError.
  virtual bool merge_log() { return true; }

  /// Ends the current statement, and every later one that takes long, with a StorageError. May be
  /// called from any thread.
  virtual void interrupt() {}
};

}  // namespace oblique::server
