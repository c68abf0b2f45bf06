// Reading back what studies there are and how far they are.
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "server/store/store.h"

namespace oblique::server {
namespace {

StudyState state_named(const std::string& name) {
  for (const StudyState state : {StudyState::kDone, StudyState::kCancelled, StudyState::kPaused}) {
    if (name == state_name(state)) {
      return state;
    }
  }
  return StudyState::kRunning;
}

/// How far the studies are, gathered by a few passes over all of them: a look at each alone would
/// cost more than the rest of a start when there are many.
struct Progress {
  std::map<std::uint64_t, std::uint64_t> rows;  // by study, of those that have any
  std::map<std::uint64_t, std::uint64_t> last;  // point that has one
  std::map<std::uint64_t, IntervalSet> failures;
  std::map<std::uint64_t, PointAttempts> attempts;
};

std::uint64_t number(Statement& statement, int column) {
  return static_cast<std::uint64_t>(statement.integer(column));
}

Progress progress_of_all(sqlite3* database) {
  Progress progress;
  // From the index alone.
  Statement rows(database, "SELECT study_id, count(*), max(point) FROM results GROUP BY study_id");
  while (rows.step()) {
    progress.rows[number(rows, 0)] = number(rows, 1);
    progress.last[number(rows, 0)] = number(rows, 2);
  }
  // The failures that are there come last: they are later than all that were forgotten.
  Statement retries(database,
                    "SELECT study_id, first_point, points, attempt FROM retries ORDER BY rowid");
  while (retries.step()) {
    const std::uint64_t first = number(retries, 1);
    progress.attempts[number(retries, 0)].set({first, first + number(retries, 2)},
                                              static_cast<std::uint32_t>(retries.integer(3)));
  }
  Statement failed(database,
                   "SELECT study_id, point, attempt FROM results WHERE status = 'failed'"
                   " ORDER BY study_id, point");
  while (failed.step()) {
    const std::uint64_t point = number(failed, 1);
    progress.failures[number(failed, 0)].insert(point);
    progress.attempts[number(failed, 0)].set({point, point + 1},
                                             static_cast<std::uint32_t>(failed.integer(2)));
  }
  return progress;
}

/// The points of a study that have a row.
IntervalSet points_of(Statement& query, std::uint64_t study_id) {
  IntervalSet points;
  Interval interval{0, 0};
  query.reset();
  query.bind(1, study_id);
  while (query.step()) {
    const std::uint64_t point = number(query, 0);
    if (point != interval.end) {
      points.insert(interval.begin, interval.end);
      interval.begin = point;
    }
    interval.end = point + 1;
  }
  points.insert(interval.begin, interval.end);
  query.reset();
  return points;
}

/// Makes sure that points can be handed out; afterwards, those of a study that rests need no table.
/// Gives why this version takes no such study, or an empty text. Throws StorageError for a recipe
/// that cannot be read.
std::string objection_to(const StoredStudy& study) {
  try {
    (void)study.table.get();
  } catch (const solver::InputError& reason) {
    return reason.what();
  } catch (const std::runtime_error& reason) {
    throw StorageError("the recipe of study " + study.name + " cannot be read: " + reason.what());
  }
  if (study.state == StudyState::kCancelled || study.state == StudyState::kPaused) {
    study.table.release();
  }
  return {};
}

}  // namespace

std::vector<StoredStudy> Store::studies() {
  std::vector<StoredStudy> found;
  Progress progress = progress_of_all(database_.get());
  Statement list(database_.get(),
                 "SELECT study_id, name, recipe, state, created_at, priority, weight,"
                 " mixes_versions, points FROM studies ORDER BY study_id");
  Statement version(database_.get(),
                    "SELECT solver_version FROM results WHERE study_id = ?"
                    " AND solver_version IS NOT NULL ORDER BY point LIMIT 1");
  Statement settled(database_.get(), "SELECT point FROM results WHERE study_id = ? ORDER BY point");
  while (list.step()) {
    StoredStudy study{};
    study.study_id = number(list, 0);
    study.name = list.text(1);
    study.table = StudyTable(list.text(2), number(list, 8));
    study.state = state_named(list.text(3));
    study.created_at = list.text(4);
    study.terms = {static_cast<std::int32_t>(list.integer(5)), list.real(6), list.integer(7) != 0};
    const std::uint64_t rows = progress.rows[study.study_id];
    if (rows > 0) {
      version.reset();
      version.bind(1, study.study_id);
      study.solver_version = version.step() ? version.text(0) : "";
      version.reset();
      const bool is_complete =
          rows == study.table.size() && progress.last[study.study_id] == rows - 1;
      study.settled = is_complete ? IntervalSet(0, rows) : points_of(settled, study.study_id);
    }
    const bool is_open = study.settled.size() < study.table.size();
    if (const std::string objection = is_open ? objection_to(study) : ""; !objection.empty()) {
      left_out_.push_back(
          "the study \"" + study.name +
          "\" is left as it is, for this version takes no such study: " + objection);
      continue;
    }
    study.failures = std::move(progress.failures[study.study_id]);
    study.attempts = std::move(progress.attempts[study.study_id]);
    found.push_back(std::move(study));
  }
  return found;
}

}  // namespace oblique::server
