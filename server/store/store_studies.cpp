// Reads the studies and their progress from the database at a start.
#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/store/recipe_check.h"
#include "server/store/result_rows.h"
#include "server/store/schema.h"
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

std::uint64_t number(Statement& statement, int column) {
  return static_cast<std::uint64_t>(statement.integer(column));
}

/// Reads the failed points of all studies, and the attempts in which points failed.
void read_failures(sqlite3* database, std::vector<StoredStudy>& studies) {
  std::map<std::uint64_t, StoredStudy*> by_number;
  for (StoredStudy& study : studies) {
    by_number[study.study_id] = &study;
  }
  const auto read = [&](const char* sql, bool is_failed) {
    Statement row(database, sql);
    while (row.step()) {
      const auto study = by_number.find(number(row, 0));
      if (study == by_number.end()) {
        continue;
      }
      const Interval points{number(row, 1), number(row, 1) + number(row, 2)};
      study->second->attempts.set(points, static_cast<std::uint32_t>(row.integer(3)));
      if (is_failed) {
        study->second->failures.insert(points.begin, points.end);
      }
    }
  };
  // Retries are read first, because a failed row of the same point is newer.
  read("SELECT study_id, first_point, points, attempt FROM retries ORDER BY rowid", false);
  read(
      "SELECT study_id, point, 1, attempt FROM results INDEXED BY failed_points"
      " WHERE error IS NOT NULL ORDER BY study_id, point",
      true);
}

/// Reads the study's recipe. Returns why this version does not accept the study, or an empty text.
/// Throws StorageError for a recipe that cannot be read.
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

bool has_condition(const StoredStudy& study) {
  return std::ranges::any_of(study.table.get()->recipe().blocks(),
                             [](const protocol::Block& block) { return !block.where().empty(); });
}

/// Throws StorageError for a study whose rows belong to another one, for example after its number
/// was changed by hand. Compares the first row, the last and some between with the recipe. In a
/// study with a filter a completed point may lack a row.
void check_rows(sqlite3* database, const StoredStudy& study) {
  constexpr std::uint64_t kCompared = 64;
  const std::uint64_t step = study.settled.size() / kCompared + 1;
  std::vector<std::uint64_t> points;
  std::uint64_t passed = 0;  // number of points in earlier runs
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
  Statement row(database, fmt::format("SELECT {} FROM results"
                                      " WHERE study_id = ? AND point = ?",
                                      RecipeCheck::kColumns));
  for (const std::uint64_t point : points) {
    row.bind(1, study.study_id);
    row.bind(2, point);
    const bool has_row = row.step();
    const std::string fault = has_row                ? recipe.fault_of(row)
                              : has_condition(study) ? ""
                                                     : "its row is gone";
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

/// The completed points of each study. Counts rows again where needed, in one transaction.
PointsOfStudies Store::completed_points() {
  PointsOfStudies completed;
  std::vector<std::uint64_t> uncounted;
  for (auto& [study_id, points] : noted_points(database_.get())) {
    if (points) {
      completed.emplace(study_id, std::move(*points));
    } else {
      uncounted.push_back(study_id);
    }
  }
  if (!uncounted.empty()) {
    in_transaction(true, [&] {
      Statement study(database_.get(), "SELECT recipe, points FROM studies WHERE study_id = ?");
      for (const std::uint64_t id : uncounted) {
        study.bind(1, id);
        if (study.step()) {
          ranges_->count_again(id, StudyTable(study.text(0), number(study, 1)));
        }
        study.reset();
      }
    });
  }
  for (const std::uint64_t id : uncounted) {
    completed.emplace(id, noted_points_of(database_.get(), id).value_or(IntervalSet()));
  }
  return completed;
}

std::vector<StoredStudy> Store::studies() {
  std::vector<StoredStudy> found;
  Statement list(database_.get(),
                 "SELECT study_id, name, recipe, state, created_at, priority,"
                 " points, coalesce(submitted_by, ''), reuses, left_out FROM studies "
                 "ORDER BY study_id");
  Statement version(database_.get(),
                    "SELECT w.solver_version FROM results AS r"
                    " CROSS JOIN workers AS w USING (worker_id)"
                    " WHERE r.study_id = ? ORDER BY r.point LIMIT 1");
  Statement taken(database_.get(), "SELECT source, points FROM reused_points WHERE study_id = ?");
  PointsOfStudies settled = completed_points();
  while (list.step()) {
    StoredStudy study{};
    study.study_id = number(list, 0);
    study.name = list.text(1);
    if (!protocol::is_utf8(study.name)) {  // messages contain UTF-8 only
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
    study.table = StudyTable(list.text(2), number(list, 6));
    study.state = state_named(list.text(3));
    study.created_at = list.text(4);
    study.priority = static_cast<std::int32_t>(list.integer(5));
    study.submitted_by = list.text(7);
    study.reuses = list.integer(8) != 0;
    study.left_out = number(list, 9);
    taken.bind(1, study.study_id);
    while (taken.step()) {
      study.taken[taken.text(0)] = number(taken, 1);
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
      study.table.release();  // not needed until the study runs again
    }
    found.push_back(std::move(study));
  }
  read_failures(database_.get(), found);
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
  in_transaction(true,
                 [this] { execute(database_.get(), "UPDATE about SET starts = starts + 1"); });
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
