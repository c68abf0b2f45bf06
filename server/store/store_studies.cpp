// Reading back what studies there are and how far they are, and the numbers that were given.
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/store/rows/recipe_check.h"
#include "server/store/rows/row_columns.h"
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

/// Makes sure that points can be handed out, and makes the study's table.
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
  return {};
}

/// Throws StorageError for a study whose rows are those of another one, as when its number was
/// changed by hand. Compares the first row, the last, and some between with the recipe.
void check_rows(sqlite3* database, const StoredStudy& study) {
  constexpr std::uint64_t kCompared = 64;
  const std::uint64_t step = study.settled.size() / kCompared + 1;
  std::vector<std::uint64_t> points;
  std::uint64_t passed = 0;  // points before the run
  study.settled.for_each([&](const Interval& run) {
    const std::uint64_t size = run.end - run.begin;
    for (std::uint64_t i = (step - passed % step) % step; i < size; i += step) {
      points.push_back(run.begin + i);
    }
    passed += size;
    if (passed == study.settled.size()) {
      points.push_back(run.end - 1);
    }
  });
  RecipeCheck recipe(database, *study.table.get());
  Statement row(database, fmt::format("SELECT {} FROM packed_results"
                                      " WHERE study_id = ? AND point = ?",
                                      RecipeCheck::kColumns));
  for (const std::uint64_t point : points) {
    row.bind(1, study.study_id);
    row.bind(2, point);
    std::string fault;
    if (row.step()) {
      fault = recipe.fault_of(row);
    } else if (study.table->is_left_in(point)) {
      fault = "its row is gone";
    }
    row.reset();
    if (!fault.empty()) {
      throw StorageError(fmt::format(
          "the results of study \"{0}\" are not those of its recipe, as after a change of study "
          "numbers by hand (point {1}: {2}). `oblique check --db FILE` names all of them. With no "
          "server at work, set the numbers that the studies had with sqlite3, or delete the study "
          "with these results: `oblique delete \"{0}\" --db FILE`",
          study.name, point, fault));
    }
  }
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
  Statement list(
      database_.get(),
      "SELECT study_id, name, recipe, state, created_at, priority, weight,"
      " mixes_versions, points, coalesce(submitted_by, ''), takes_over, left_out FROM studies "
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
    if (list.integer(0) < 1) {
      throw StorageError(fmt::format(
          "study \"{0}\" has the number {1}, and study numbers begin with 1. With no server at "
          "work, set the number that it had (sqlite3 FILE \"UPDATE studies SET study_id = NUMBER "
          "WHERE study_id = {1}\"), or delete it: `oblique delete \"{0}\" --db FILE`. `oblique "
          "check` tells more",
          study.name, list.integer(0)));
    }
    study.table = StudyTable(list.text(2), number(list, 8));
    study.state = state_named(list.text(3));
    study.created_at = list.text(4);
    study.terms = {static_cast<std::int32_t>(list.integer(5)), list.real(6), list.integer(7) != 0};
    study.submitted_by = list.text(9);
    study.takes_over = list.integer(10) != 0;
    study.left_out = number(list, 11);
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
    const std::string objection = objection_to(study);
    if (objection.empty()) {
      check_rows(database_.get(), study);
    } else if (is_open) {
      left_out_.push_back(
          "the study \"" + study.name +
          "\" is left as it is, for this version takes no such study: " + objection);
      continue;
    }
    if (!is_open || study.state != StudyState::kRunning) {
      study.table.release();  // nobody computes with it for now
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
  const std::uint64_t last = highest("SELECT " + last_study_id_sql());
  if (last == std::numeric_limits<std::int64_t>::max()) {
    throw StorageError("no number is left for another study: a table has rows of study number " +
                       std::to_string(last) + ". `oblique check` tells more");
  }
  return last;
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

}  // namespace oblique::server
