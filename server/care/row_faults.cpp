#include "server/care/row_faults.h"

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/canonical.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "server/store/rows/list_faults.h"
#include "server/store/rows/recipe_check.h"
#include "server/store/rows/row_columns.h"
#include "server/store/rows/stored_units.h"

namespace oblique::server {
namespace {

/// Collects what is found of one kind.
class Found {
 public:
  Found(std::vector<std::string>& faults, std::size_t at_most)
      : faults_(faults), most_(faults.size() + at_most) {}

  bool is_full() const { return faults_.size() >= most_; }
  void add(std::string fault) {
    if (!is_full()) {
      faults_.push_back(std::move(fault));
    }
  }
  /// Adds the first column of every row.
  void add_all(sqlite3* database, const std::string& sql) {
    Statement statement(database, sql);
    while (!is_full() && statement.step()) {
      add(statement.text(0));
    }
    statement.reset();
  }

 private:
  std::vector<std::string>& faults_;
  std::size_t most_;
};

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

/// Numbers that were too large for the unit in which they are stored, or set so by hand.
std::string infinite_outputs_sql() {
  std::string what;
  for (const StoredUnit& unit : stored_units()) {
    what += fmt::format(" WHEN abs({}) >= 9e999 THEN '{}'", unit.stored, unit.column);
  }
  return fmt::format(
      "SELECT 'study ' || study_id || ', point ' || point || ': its ' || what ||"
      " ' is not a finite number' FROM (SELECT study_id, point, CASE{} END AS what"
      " FROM packed_results) WHERE what IS NOT NULL",
      what);
}

/// Holds each row of a model against its definition.
void check_models(sqlite3* database, Found& found) {
  std::string columns = "model_id, definition";
  for (const auto& key : solver::model_keys()) {
    columns += ", " + std::string(key.name);
  }
  Statement rows(database, "SELECT " + columns + " FROM models");
  while (!found.is_full() && rows.step()) {
    const std::string name = "model " + std::to_string(rows.integer(0));
    solver::ModelParameters model;
    try {
      model = protocol::model_of_canonical(rows.text(1));
    } catch (const std::runtime_error& error) {
      found.add(name + ": its definition cannot be read: " + error.what());
      continue;
    }
    int column = 2;
    for (const auto& key : solver::model_keys()) {
      const bool agrees = key.name == "integrator"
                              ? rows.text(column) == solver::integrator_name(model.integrator)
                              : rows.is_null(column) || rows.real(column) == key.get(model);
      if (!agrees) {
        found.add(name + ": " + std::string(key.name) + " is not that of its definition");
      }
      ++column;
    }
  }
  rows.reset();
}

/// Holds the rows of one study against its recipe, in the order of the points.
class StudyCheck {
 public:
  explicit StudyCheck(sqlite3* database) : database_(database), rows_(database, rows_sql()) {}

  void run(std::int64_t study_id, const std::string& name, const protocol::PointTable& table,
           Found& found) {
    RecipeCheck recipe(database_, table);
    rows_.reset();
    rows_.bind(1, study_id);
    std::uint64_t of_no_point = 0;
    while (!found.is_full() && rows_.step()) {
      const auto number = static_cast<std::uint64_t>(rows_.integer(0));  // below 0: beyond all
      if (number >= table.size()) {
        ++of_no_point;
        continue;
      }
      std::string fault = recipe.fault_of(rows_);
      if (fault.empty() && rows_.integer(5) != 0) {
        fault = fault_of_arrays(rows_, kFirstArray);
      }
      if (!fault.empty()) {
        found.add("study " + name + ", point " + std::to_string(number) + ": " + fault);
      }
    }
    if (of_no_point > 0) {
      found.add(
          fmt::format("study {}: {} results of points that it does not have", name, of_no_point));
    }
    rows_.reset();
  }

 private:
  static constexpr int kFirstArray = 6;

  /// Lists are compared with the other columns in rows without a checksum. Lists that views cannot
  /// unfold are not read here: `faults_of_rows` reports them.
  static std::string rows_sql() {
    constexpr const char* kWhen = "checksum IS NULL AND has_sound_lists";
    return fmt::format(
        "SELECT {}, status = 'solved' AND {}, {} FROM results JOIN"
        " (SELECT study_id, point, {} AS has_sound_lists FROM packed_results)"
        " USING (study_id, point) WHERE study_id = ? ORDER BY point",
        RecipeCheck::kColumns, kWhen, array_columns_sql(kWhen), lists_are_sound_sql());
  }

  sqlite3* database_;
  Statement rows_;
};

void check_studies(sqlite3* database, Found& found) {
  StudyCheck check(database);
  Statement studies(database, "SELECT study_id, name, recipe, points FROM studies");
  while (!found.is_full() && studies.step()) {
    const std::string name = studies.text(1);
    protocol::Recipe recipe;
    try {
      if (!protocol::parse_recipe(studies.bytes(2), recipe)) {
        throw std::runtime_error("its bytes are damaged, or more than a recipe may have");
      }
      const protocol::PointTable table(std::move(recipe));
      if (table.points() != static_cast<std::uint64_t>(studies.integer(3))) {
        found.add("study " + name + ": it has " + std::to_string(studies.integer(3)) +
                  " points, and " + std::to_string(table.points()) + " by its recipe");
      }
      check.run(studies.integer(0), name, table, found);
    } catch (const StorageError&) {
      throw;
    } catch (const std::runtime_error& error) {
      found.add("study " + name + ": its recipe cannot be read: " + error.what());
    }
  }
  studies.reset();
}

}  // namespace

std::vector<std::string> faults_of_models(sqlite3* database, std::size_t at_most) {
  std::vector<std::string> faults;
  Found found(faults, at_most);
  check_models(database, found);
  return faults;
}

std::vector<std::string> faults_of_rows(sqlite3* database, std::size_t at_most) {
  std::vector<std::string> faults;
  const auto kind = [&] { return Found(faults, at_most); };
  kind().add_all(
      database,
      fmt::format("SELECT 'study ' || study_id || ', point ' || point || ': one of its lists"
                  " cannot be read, or has more than {} elements' FROM packed_results"
                  " WHERE NOT {}",
                  protocol::kMostListElements, lists_are_sound_sql()));
  kind().add_all(database,
                 "SELECT 'text ' || text_id || ' is not the one that was stored' FROM texts"
                 " WHERE checksum <> " +
                     text_checksum_sql());
  kind().add_all(database,
                 "SELECT 'worker ' || worker_id || ' is not the one that was stored' FROM workers"
                 " WHERE checksum <> " +
                     worker_checksum_sql());
  kind().add_all(database,
                 "SELECT 'study ' || study_id || ', ' || name || ': its number, name, recipe or"
                 " size is not the one that was stored' FROM studies WHERE checksum <> " +
                     study_checksum_sql());
  kind().add_all(database,
                 "SELECT 'study ' || study_id || ', point ' || point || ': its row is not the one"
                 " that was stored' FROM packed_results WHERE checksum <> " +
                     result_checksum_sql());
  kind().add_all(database, misplaced_outputs_sql());
  kind().add_all(database, infinite_outputs_sql());
  auto models = kind();
  check_models(database, models);
  auto studies = kind();
  check_studies(database, studies);
  return faults;
}

}  // namespace oblique::server
