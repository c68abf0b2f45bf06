#include "server/maintenance/check.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "proto/recipe/canonical.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "server/database/open_for_reading.h"
#include "server/database/row_checksum.h"
#include "server/store/rows/recipe_check.h"
#include "server/store/rows/row_columns.h"
#include "server/store/rows/settled_runs.h"
#include "server/store/schema/schema_setup.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostOfAKind = 20;

/// Appends the first column of at most `at_most` rows.
void append(std::vector<std::string>& to, sqlite3* database, const std::string& sql,
            std::size_t at_most = kMostOfAKind) {
  Statement rows(database, sql);
  for (std::size_t i = 0; i < at_most && rows.step(); ++i) {
    to.push_back(rows.text(0));
  }
}

void append(std::vector<std::string>& to, std::vector<std::string> faults) {
  std::move(faults.begin(), faults.end(), std::back_inserter(to));
}

/// References of our tables to rows that do not exist. Rows of a study that is being deleted have
/// no study.
std::vector<std::string> faults_of_references(sqlite3* database, std::size_t at_most) {
  std::vector<std::string> faults;
  for (const std::string& table : our_tables()) {
    append(faults, database,
           fmt::format("SELECT 'table {0}' || coalesce(', row ' || rowid, '') ||"
                       " ': refers to a row of ' || parent || ' that does not exist'"
                       " FROM pragma_foreign_key_check('{0}')"
                       " WHERE parent <> 'studies' OR NOT EXISTS (SELECT 1 FROM deletions)",
                       table),
           at_most);
  }
  append(faults, database,
         "SELECT DISTINCT 'table packed_results: refers to study number ' || study_id ||"
         " ', which does not exist' FROM packed_results WHERE EXISTS (SELECT 1 FROM deletions) AND"
         " study_id NOT IN (SELECT study_id FROM studies UNION SELECT study_id FROM deletions)",
         at_most);
  return faults;
}

/// Tables that other people made may have foreign keys that are violated or cannot be checked.
void check_other_tables(sqlite3* database, Diagnosis& found) {
  std::vector<std::string> tables;
  append(tables, database, "SELECT name FROM sqlite_schema WHERE type = 'table'",
         std::numeric_limits<std::size_t>::max());
  for (const std::string& table : tables) {
    if (std::count(our_tables().begin(), our_tables().end(), table) > 0) {
      continue;
    }
    try {
      Statement rows(database, "SELECT parent FROM pragma_foreign_key_check(?)");
      rows.bind(1, std::string_view(table));
      if (rows.step()) {
        found.faults.push_back(fmt::format("table {}: refers to a row of {} that does not exist",
                                           table, rows.text(0)));
      }
    } catch (const StorageError& error) {
      found.remarks.push_back(fmt::format("the foreign keys of the table {} cannot be checked: {}",
                                          table, error.what()));
    }
  }
}

/// Outputs that a row has or lacks without reason.
std::string misplaced_outputs_sql() {
  const auto number_missing = [](std::span<const std::string_view> columns) {
    return fmt::format("(({} IS NULL))", fmt::join(columns, " IS NULL) + ("));
  };
  return fmt::format(
      "SELECT 'study ' || study_id || ', point ' || point || CASE WHEN error IS NULL"
      " THEN ': it is solved, and outputs are missing' ELSE ': it is failed, and has outputs' END"
      " FROM packed_results WHERE CASE WHEN error IS NULL THEN {} > 0 ELSE {} < {} END",
      number_missing(certain_outputs()), number_missing(packed_outputs()), packed_outputs().size());
}

/// The column that differs from the model's definition; empty: none.
std::string differing_column(const Statement& row, const solver::ModelParameters& model) {
  if (row.text(2) != nlohmann::json(model.lengths_m).dump()) {
    return "lengths_m";
  }
  int column = 3;
  for (const auto& key : solver::model_keys()) {
    const bool agrees = key.name == "integrator"
                            ? row.text(column) == solver::integrator_name(model.integrator)
                            : row.is_null(column) || row.real(column) == key.get(model);
    if (!agrees) {
      return std::string(key.name);
    }
    ++column;
  }
  return {};
}

std::vector<std::string> faults_of_models(sqlite3* database, std::size_t at_most) {
  std::vector<std::string> faults;
  std::string columns = "model_id, definition, lengths_m";
  for (const auto& key : solver::model_keys()) {
    columns += ", " + std::string(key.name);
  }
  Statement rows(database, "SELECT " + columns + " FROM models");
  while (faults.size() < at_most && rows.step()) {
    try {
      const std::string column = differing_column(rows, protocol::model_of_canonical(rows.text(1)));
      if (!column.empty()) {
        faults.push_back(
            fmt::format("model {}: {} is not that of its definition", rows.integer(0), column));
      }
    } catch (const std::runtime_error& error) {
      faults.push_back(fmt::format("model {}: its definition cannot be read: {}", rows.integer(0),
                                   error.what()));
    }
  }
  return faults;
}

/// Compares each row of a study with its recipe.
void check_rows(sqlite3* database, std::int64_t study_id, const std::string& name,
                const protocol::PointTable& table, std::vector<std::string>& faults) {
  RecipeCheck recipe(database, table);
  Statement rows(database, fmt::format("SELECT {} FROM packed_results WHERE study_id = ?"
                                       " ORDER BY point",
                                       RecipeCheck::kColumns));
  rows.bind(1, study_id);
  while (faults.size() < kMostOfAKind && rows.step()) {
    if (const std::string fault = recipe.fault_of(rows); !fault.empty()) {
      faults.push_back(fmt::format("study {}, point {}: {}", name, rows.integer(0), fault));
    }
  }
}

std::vector<std::string> faults_of_recipes(sqlite3* database) {
  std::vector<std::string> faults;
  Statement studies(database, "SELECT study_id, name, recipe, points FROM studies");
  while (faults.size() < kMostOfAKind && studies.step()) {
    const std::string name = studies.text(1);
    try {
      protocol::Recipe recipe;
      if (!protocol::parse_recipe(studies.bytes(2), recipe)) {
        throw std::runtime_error("its bytes are damaged, or more than a recipe may have");
      }
      const protocol::PointTable table(std::move(recipe));
      if (table.size() != static_cast<std::uint64_t>(studies.integer(3))) {
        faults.push_back(fmt::format("study {}: it has {} points, and {} by its recipe", name,
                                     studies.integer(3), table.size()));
      }
      check_rows(database, studies.integer(0), name, table, faults);
    } catch (const StorageError&) {
      throw;
    } catch (const std::runtime_error& error) {
      faults.push_back(fmt::format("study {}: its recipe cannot be read: {}", name, error.what()));
    }
  }
  return faults;
}

/// Whether `settled` are the points of `rows` and `left_out` others.
bool is_sum_of(const IntervalSet& settled, const IntervalSet& rows, std::uint64_t left_out) {
  IntervalSet others = settled;
  rows.for_each([&](const Interval& run) { others.erase(run.begin, run.end); });
  return others.size() == left_out && settled.size() == rows.size() + left_out;
}

/// Compares `settled_points` and the state of each study with its rows.
void check_counts(sqlite3* database, Diagnosis& found) {
  constexpr auto kLast = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  std::vector<std::string> faults;
  const auto noted = noted_points(database);
  Statement studies(
      database, "SELECT study_id, name, state, points, left_out FROM studies ORDER BY study_id");
  while (studies.step()) {
    const auto id = static_cast<std::uint64_t>(studies.integer(0));
    const std::string name = studies.text(1);
    const std::string state = studies.text(2);
    const auto points = static_cast<std::uint64_t>(studies.integer(3));
    const auto left_out = static_cast<std::uint64_t>(studies.integer(4));
    const IntervalSet rows = points_with_row(database, id, {0, kLast});
    if (const auto known = noted.find(id); known != noted.end() && !known->second) {
      found.remarks.push_back(
          fmt::format("study {}: another program deleted results; they are counted when a server "
                      "starts",
                      name));
    } else if (const IntervalSet settled = known == noted.end() ? IntervalSet() : *known->second;
               !is_sum_of(settled, rows, left_out)) {
      faults.push_back(fmt::format(
          "study {}: settled_points has {} points and results {}, and they are not the same"
          " without the {} that its filter leaves out. "
          "UPDATE "
          "studies SET counted = 0 WHERE study_id = {} has them counted when a server starts",
          name, settled.size(), rows.size(), left_out, id));
    }
    if (state == "done" && rows.size() + left_out != points) {
      faults.push_back(
          fmt::format("study {} is called done with {} of {} results", name, rows.size(), points));
    }
    if (rows.size() + left_out < points) {
      found.remarks.push_back(fmt::format("study {} is {}: {} of {} points have a result", name,
                                          state, rows.size(), points));
    }
  }
  faults.resize(std::min(faults.size(), kMostOfAKind));
  append(found.faults, std::move(faults));
}

}  // namespace

std::vector<std::string> faults_of_pages(sqlite3* database) {
  std::vector<std::string> found;
  try {
    append(found, database, "PRAGMA integrity_check(20)");
  } catch (const StorageError& error) {
    return {error.what()};  // too damaged for SQLite's check
  }
  return found == std::vector<std::string>{"ok"} ? std::vector<std::string>{} : found;
}

std::vector<std::string> faults_of_rows(sqlite3* database, std::size_t at_most) {
  std::vector<std::string> faults = faults_of_references(database, at_most);
  for (const std::string& sql :
       {"SELECT 'text ' || text_id || ' is not the one that was stored' FROM texts"
        " WHERE checksum <> " +
            text_checksum_sql(),
        "SELECT 'worker ' || worker_id || ' is not the one that was stored' FROM workers"
        " WHERE checksum <> " +
            worker_checksum_sql(),
        "SELECT 'study ' || study_id || ', ' || name || ': its number, name, recipe or size is not"
        " the one that was stored' FROM studies WHERE checksum <> " +
            study_checksum_sql(),
        "SELECT 'study ' || study_id || ', point ' || point || ': its row is not the one that was"
        " stored' FROM packed_results WHERE checksum <> " +
            result_checksum_sql(),
        fmt::format("SELECT 'study ' || study_id || ', point ' || point || ': one of its lists"
                    " cannot be read, or has more than {} elements' FROM packed_results"
                    " WHERE NOT {}",
                    protocol::kMostListElements, lists_are_sound_sql()),
        misplaced_outputs_sql()}) {
    append(faults, database, sql, at_most);
  }
  append(faults, faults_of_models(database, at_most));
  return faults;
}

Diagnosis diagnose(const std::string& path) {
  const OpenedForReading opened = open_stored(path);
  sqlite3* database = opened.database.get();
  Diagnosis found;
  if (!opened.remark.empty()) {
    found.remarks.push_back(opened.remark);
  }
  found.faults = faults_of_pages(database);
  if (!found.faults.empty()) {
    return found;  // damaged pages make every other answer meaningless
  }
  for (const std::string& table : missing_tables(database)) {
    found.faults.push_back(fmt::format(
        "the table {} is missing, and no server starts on this file: `oblique backup --salvage` "
        "makes one that has it, of all that can be read",
        table));
  }
  if (!found.faults.empty()) {
    return found;  // the other checks need all tables
  }
  add_row_checksum(database);
  execute(database, "BEGIN");  // one instant of rows and counts while a server writes
  check_other_tables(database, found);
  for (const std::string& view : missing_views(database)) {
    found.faults.push_back(
        fmt::format("the view {} is missing: the next server on this file creates it", view));
  }
  for (const std::string& trigger : other_triggers(database)) {
    found.faults.push_back(fmt::format(
        "the trigger {} is not ours: no server works on this file until it is dropped", trigger));
  }
  append(found.faults, faults_of_rows(database, kMostOfAKind));
  append(found.faults, faults_of_recipes(database));
  append(found.remarks, database,
         "SELECT count(*) || ' results of deleted studies are left; the next server deletes them'"
         " FROM packed_results WHERE study_id IN (SELECT study_id FROM deletions)"
         " HAVING count(*) > 0");
  check_counts(database, found);
  append(found.remarks, database,
         "SELECT count(*) || ' of ' || (SELECT count(*) FROM packed_results) || ' results have"
         " no checksum: a flipped bit in them may go unseen'"
         " FROM packed_results WHERE checksum IS NULL HAVING count(*) > 0");
  return found;
}

std::vector<std::string> find_faults(const std::string& path) {
  return diagnose(path).faults;
}

}  // namespace oblique::server
