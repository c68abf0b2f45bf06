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
#include "server/study/study_terms.h"

namespace oblique::server {

enum class StudyState { kRunning, kPaused, kCancelled, kDone };
inline constexpr std::size_t kStudyStates = 4;

/// As in the column `studies.state`.
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

// What can be written to the database. Instants are UTC in ISO 8601.

struct AddStudy {
  std::uint64_t study_id;
  std::string name;
  StudyTable table;
  std::string created_at;
  StudyTerms terms{};
  std::string submitted_by = {};  ///< name of the key; empty: without keys
  bool takes_over = false;        ///< results of other studies are looked up
};

struct SetStudyTerms {
  std::uint64_t study_id;
  StudyTerms terms{};
};

/// Forgets that these points failed; a study that was done is running again. Rows of solved points
/// stay.
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
  IntervalSet left_out{};  ///< points that a filter leaves out: they are completed without a row
};

/// The study has further points, behind those that it had, and runs on these terms.
struct GrowStudy {
  std::uint64_t study_id;
  StudyTable table;  ///< of all its points
  StudyTerms terms;
  std::string changed_at;
  bool takes_over = false;  ///< as in AddStudy
};

/// What became of a ReuseResults. Read it when the change is durable.
struct ReusedResults {
  IntervalSet points;                              ///< that got a row
  std::map<std::string, std::uint64_t> origins{};  ///< how many, by the name of their source
  std::uint64_t probes = 0;                        ///< lookups that were made
  std::optional<std::uint64_t> next_point = {};    ///< where the next part begins; none: at the end
};

/// Looks up one part of the study's open points, from `first_point` on, among the solved points of
/// other studies, and copies the rows that it finds: those of that solver version, of studies that
/// ask for estimated errors as this one does or does not.
struct ReuseResults {
  std::uint64_t study_id;
  std::shared_ptr<const protocol::PointTable> table;
  std::uint64_t first_point;
  std::string solver_version;
  std::shared_ptr<ReusedResults> outcome;  ///< is filled in
};

/// No more results of other studies are looked up for it.
struct EndTaking {
  std::uint64_t study_id;
};

struct RenameStudy {
  std::uint64_t study_id;
  std::string name;
};

/// There is no such study any more, its name is free, and results of it are dropped from then on.
/// Its rows go a few at a time (`Storage::clear_away`).
struct DeleteStudy {
  std::uint64_t study_id;
};

using Change =
    std::variant<AddStudy, SetStudyState, SetStudyTerms, ForgetFailures, GrowStudy, RenameStudy,
                 DeleteStudy, ReuseResults, EndTaking, AddWorker, AddResults>;

/// How much of what deleted studies left is gone.
enum class ClearedAway {
  kAll,
  kPart,
  kMustWait,  ///< nothing more for now: readers keep the write-ahead log long
};

/// What the writer needs of a database. Tests put a failing one in its place.
class Storage {
 public:
  virtual ~Storage() = default;

  /// Makes all changes durable, in order, in one transaction. Throws StorageError: then none of
  /// them was kept. Throws StorageGone as `check` does, before and after the transaction: nothing
  /// that came back is lost.
  virtual void commit(std::span<const Change> changes) = 0;

  /// Throws StorageGone when the database is not where it was opened.
  virtual void check() {}

  /// Deletes a part of what deleted studies left, in one transaction: at most about so many rows,
  /// or what takes as long. Throws as `commit` does.
  virtual ClearedAway clear_away(std::size_t /*most*/) { return ClearedAway::kAll; }

  /// Moves the write-ahead log into the database and empties it, so that the one file holds all.
  /// False when a reader keeps it from doing so: to be tried again. Throws StorageError.
  virtual bool merge_log() { return true; }

  /// Ends the statement under way, and every later one that takes long, with a StorageError. From
  /// any thread.
  virtual void interrupt() {}
};

}  // namespace oblique::server
