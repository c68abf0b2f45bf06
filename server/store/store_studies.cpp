// Reading back what studies there are and how far they are, and the numbers that were given.
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
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

/// What is known of failures, gathered by a pass over all of them.
struct Progress {
  std::map<std::uint64_t, IntervalSet> failures;
  std::map<std::uint64_t, PointAttempts> attempts;
};

std::uint64_t number(Statement& statement, int column) {
  return static_cast<std::uint64_t>(statement.integer(column));
}

Progress progress_of_all(sqlite3* database) {
  Progress progress;
  // The failures that are there come last: they are later than all that were forgotten.
  Statement retries(database,
                    "SELECT study_id, first_point, points, attempt FROM retries ORDER BY rowid");
  while (retries.step()) {
    const std::uint64_t first = number(retries, 1);
    progress.attempts[number(retries, 0)].set({first, first + number(retries, 2)},
                                              static_cast<std::uint32_t>(retries.integer(3)));
  }
  Statement failed(database,
                   "SELECT study_id, point, attempt FROM packed_results INDEXED BY failed_points"
                   " WHERE error IS NOT NULL"
                   " ORDER BY study_id, point");
  while (failed.step()) {
    const std::uint64_t point = number(failed, 1);
    progress.failures[number(failed, 0)].insert(point);
    progress.attempts[number(failed, 0)].set({point, point + 1},
                                             static_cast<std::uint32_t>(failed.integer(2)));
  }
  return progress;
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
    throw StorageError("the recipe of study " + study.name + " cannot be read: " + reason.what() +
                       ". `oblique check` tells more");
  }
  if (study.state == StudyState::kCancelled || study.state == StudyState::kPaused) {
    study.table.release();
  }
  return {};
}

}  // namespace

/// What is in doubt is counted in one transaction.
PointsOfStudies Store::settled_points() {
  auto found = noted_points(database_.get());
  std::optional<Transaction> counting;
  for (const auto& [study_id, points] : found) {
    if (!points) {
      if (!counting) {
        log_->make_sure();
        counting.emplace(database_.get());
      }
      settled_->count_again(study_id);
    }
  }
  if (counting) {
    counting->commit();
    found = noted_points(database_.get());
  }
  PointsOfStudies settled;
  for (auto& [study_id, points] : found) {
    settled.emplace(study_id, std::move(points).value_or(IntervalSet()));
  }
  return settled;
}

std::vector<StoredStudy> Store::studies() {
  std::vector<StoredStudy> found;
  Progress progress = progress_of_all(database_.get());
  Statement list(database_.get(),
                 "SELECT study_id, name, recipe, state, created_at, priority, weight,"
                 " mixes_versions, points, coalesce(submitted_by, ''), takes_over FROM studies "
                 "ORDER BY study_id");
  Statement version(database_.get(),
                    "SELECT w.solver_version FROM packed_results AS r"
                    " CROSS JOIN workers AS w ON w.worker_id = r.worker"
                    " WHERE r.study_id = ? ORDER BY r.point LIMIT 1");
  Statement taken(database_.get(),
                  "SELECT o.name, t.points FROM taken_points AS t"
                  " JOIN origins AS o USING (origin_id) WHERE t.study_id = ?");
  PointsOfStudies settled = settled_points();
  while (list.step()) {
    StoredStudy study{};
    study.study_id = number(list, 0);
    study.name = list.text(1);
    if (!protocol::is_utf8(study.name)) {  // no message may carry it
      left_out_.push_back(fmt::format(
          "study {} is left as it is, for its name \"{}\" is no UTF-8: with no server at work, "
          "sqlite3 gives it another (UPDATE studies SET name = 'NAME' WHERE study_id = {})",
          study.study_id, protocol::visible(study.name), study.study_id));
      continue;
    }
    study.table = StudyTable(list.text(2), number(list, 8));
    study.state = state_named(list.text(3));
    study.created_at = list.text(4);
    study.terms = {static_cast<std::int32_t>(list.integer(5)), list.real(6), list.integer(7) != 0};
    study.submitted_by = list.text(9);
    study.takes_over = list.integer(10) != 0;
    taken.bind(1, study.study_id);
    while (taken.step()) {
      study.taken[taken.text(0)] += number(taken, 1);
    }
    taken.reset();
    study.settled = std::move(settled[study.study_id]);
    version.bind(1, study.study_id);
    study.solver_version = version.step() ? version.text(0) : "";
    version.reset();
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

std::uint64_t Store::highest(const std::string& sql) {
  Statement statement(database_.get(), sql);
  return statement.step() ? static_cast<std::uint64_t>(statement.integer(0)) : 0;
}

std::uint64_t Store::last_study_id() {
  return highest(
      "SELECT max(last_study_id, coalesce((SELECT max(study_id) FROM studies), 0))"
      " FROM about");
}

std::uint64_t Store::last_worker_id() {
  return highest("SELECT max(worker_id) FROM workers");
}

std::uint64_t Store::count_start() {
  log_->make_sure();
  set_sync(true);
  Transaction transaction(database_.get());
  execute(database_.get(), "UPDATE about SET starts = starts + 1");
  transaction.commit();
  return highest("SELECT starts FROM about");
}

std::string Store::database_id() {
  Statement statement(database_.get(), "SELECT database_id FROM about");
  if (!statement.step()) {
    throw StorageError("the database has lost its identity: the table about is empty");
  }
  return statement.text(0);
}

/// Whoever comes after must not find our log beside another database, where SQLite would take it
/// for that one's. What was acknowledged goes into our own file, wherever that may be now.
void Store::leave_files() {
  try {
    if (files_->were_overwritten()) {
      log_->discard();
    } else {
      log_->merge();
    }
  } catch (const StorageError&) {
    // Nothing more can be done for it.
  }
}

}  // namespace oblique::server
