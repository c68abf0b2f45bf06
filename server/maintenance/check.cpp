#include "server/maintenance/check.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "proto/recipe/model_message.h"
#include "proto/recipe/written.h"
#include "server/database/open_for_reading.h"
#include "server/database/row_checksum.h"
#include "server/store/completed_ranges.h"
#include "server/store/recipe_check.h"
#include "server/store/result_rows.h"
#include "server/store/schema.h"
#include "server/study/study_table.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostOfAKind = 20;

/// Appends the first column of the first kMostOfAKind rows.
void append(std::vector<std::string>& to, sqlite3* database, const std::string& sql) {
  Statement rows(database, sql);
  for (std::size_t i = 0; i < kMostOfAKind && rows.step(); ++i) {
    to.push_back(rows.text(0));
  }
}

void append(std::vector<std::string>& to, const std::vector<std::string>& faults) {
  to.insert(to.end(), faults.begin(),
            faults.begin() + static_cast<std::ptrdiff_t>(std::min(faults.size(), kMostOfAKind)));
}

/// A statement without its comments and spaces; quoted parts stay as they are.
std::string without_comments(std::string_view sql) {
  std::string rest;
  for (std::size_t i = 0; i < sql.size(); ++i) {
    if (sql[i] == '\'' || sql[i] == '"' || sql[i] == '`' || sql[i] == '[') {
      const std::size_t end = std::min(sql.find(sql[i] == '[' ? ']' : sql[i], i + 1), sql.size());
      rest += sql.substr(i, end + 1 - i);
      i = end;
    } else if (sql.substr(i, 2) == "--") {
      i = std::min(sql.find('\n', i), sql.size());
    } else if (std::isspace(static_cast<unsigned char>(sql[i])) == 0) {
      rest += sql[i];
    }
  }
  return rest;
}

/// A table with another definition could compute values without end, or accept values that no
/// server stores.
std::vector<std::string> faults_of_tables(sqlite3* database) {
  std::vector<std::string> faults;
  Statement find(database,
                 "SELECT sql FROM sqlite_schema WHERE type = 'table' AND name = ? COLLATE NOCASE");
  for (const TableDefinition& table : our_tables()) {
    find.bind(1, table.name);
    const bool is_there = find.step();
    if (!is_there || without_comments(find.text(0)) != without_comments(table.sql)) {
      faults.push_back(fmt::format(
          "the table {} is {}: `oblique backup --salvage` makes a file "
          "that has it, with all rows that can be read",
          table.name,
          is_there ? "not as servers make it" : "missing, and no server starts on this file"));
    }
    find.reset();
  }
  return faults;
}

/// The first column that differs from the model's definition; empty: none.
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

std::vector<std::string> faults_of_models(sqlite3* database) {
  std::vector<std::string> faults;
  std::string columns = "model_id, definition, lengths_m";
  for (const auto& key : solver::model_keys()) {
    columns += ", " + std::string(key.name);
  }
  Statement rows(database, "SELECT " + columns + " FROM models");
  while (faults.size() < kMostOfAKind && rows.step()) {
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

/// Checks studies one after the other, each with all its rows in one pass.
class StudyCheck {
 public:
  StudyCheck(sqlite3* database, Diagnosis& found)
      : database_(database),
        found_(found),
        noted_(noted_points(database)),
        studies_(database, fmt::format("SELECT study_id, name, recipe, points, state, priority,"
                                       " max(length(created_at), length(changed_at)),"
                                       " checksum <> {}, left_out FROM studies ORDER BY study_id",
                                       study_checksum_sql())),
        rows_(database, fmt::format("SELECT {}, checksum IS NULL, coalesce({},"
                                    " CASE WHEN model_id NOT IN (SELECT model_id FROM models)"
                                    " THEN 'its model does not exist'"
                                    " WHEN worker_id IS NOT NULL AND worker_id NOT IN"
                                    " (SELECT worker_id FROM workers)"
                                    " THEN 'its worker does not exist' END)"
                                    " FROM results WHERE study_id = ? ORDER BY point",
                                    RecipeCheck::kColumns, row_fault_sql())) {}

  void run() {
    while (studies_.step()) {
      name_ = studies_.text(1);
      if (studies_.integer(7) != 0) {
        add_fault("its number, name, recipe or size is not the one that was stored");
      }
      check_terms();
      const StudyTable table = read_table();
      const IntervalSet points = check_rows(table);
      check_completed(table, points);
    }
    append(found_.faults, study_faults_);
    append(found_.faults, row_faults_);
    if (without_checksum_ > 0) {
      found_.remarks.push_back(
          fmt::format("{} of {} results have no checksum: a flipped bit in them may go unseen",
                      without_checksum_, all_rows_));
    }
  }

 private:
  void add_fault(const std::string& fault) {
    study_faults_.push_back(fmt::format("study {}, {}: {}", studies_.integer(0), name_, fault));
  }

  /// Checks for values that no server stores; they could keep a server from starting, or could not
  /// be shown.
  void check_terms() {
    constexpr std::int64_t kLongestTime = 64;
    for (const std::string& objection :
         {protocol::objection_to_study_name(name_),
          protocol::objection_to_priority(studies_.integer(5)),
          std::string(studies_.integer(6) > kLongestTime ? "its times are not valid" : "")}) {
      if (!objection.empty()) {
        add_fault(objection);
      }
    }
  }

  /// The table of the study; its points are computed if the recipe can be read.
  StudyTable read_table() {
    StudyTable table(studies_.text(2), static_cast<std::uint64_t>(studies_.integer(3)));
    try {
      (void)table.get();
    } catch (const std::runtime_error& error) {
      add_fault(fmt::format("its recipe cannot be read: {}", error.what()));
    }
    return table;
  }

  /// Returns the points that have a row.
  IntervalSet check_rows(const StudyTable& table) {
    constexpr int kNoChecksum = 5;
    constexpr int kFault = 6;
    IntervalSet points;
    std::optional<RecipeCheck> recipe;
    if (table.is_made()) {
      recipe.emplace(database_, *table.get());
    }
    rows_.bind(1, studies_.integer(0));
    while (rows_.step()) {
      points.insert(static_cast<std::uint64_t>(rows_.integer(0)));
      ++all_rows_;
      without_checksum_ += rows_.integer(kNoChecksum) != 0 ? 1U : 0U;
      std::string fault = rows_.text(kFault);
      if (fault.empty() && recipe) {
        fault = recipe->fault_of(rows_);
      }
      if (!fault.empty() && row_faults_.size() < kMostOfAKind) {
        row_faults_.push_back(
            fmt::format("study {}, point {}: {}", name_, rows_.integer(0), fault));
      }
    }
    rows_.reset();
    return points;
  }

  /// Compares `completed_ranges` and the state with the points that have a row. Only a filter can
  /// make a point completed without a row.
  void check_completed(const StudyTable& table, const IntervalSet& rows) {
    const auto& noted = noted_[static_cast<std::uint64_t>(studies_.integer(0))];
    const IntervalSet& completed = noted ? *noted : rows;
    if (!noted) {
      found_.remarks.push_back(fmt::format(
          "study {}: another program deleted results; they are counted when a server starts",
          name_));
    }
    IntervalSet without_row = completed;
    rows.for_each([&](const Interval& range) { without_row.erase(range.begin, range.end); });
    const bool has_filter = table.is_made() && table->has_filter();
    if (rows.size() + without_row.size() != completed.size() ||
        (!without_row.empty() && !has_filter) ||
        (noted && without_row.size() != static_cast<std::uint64_t>(studies_.integer(8)))) {
      add_fault(fmt::format(
          "completed_ranges has {} points and results {}, and they are not the same. UPDATE "
          "studies SET counted = 0 WHERE study_id = {} makes the next server count them",
          completed.size(), rows.size(), studies_.integer(0)));
    }
    const std::string state = studies_.text(4);
    if (completed.size() != table.size()) {
      (state == "done" ? study_faults_ : found_.remarks)
          .push_back(fmt::format("study {} is {}: {} of {} points have a result", name_, state,
                                 completed.size(), table.size()));
    }
  }

  sqlite3* database_;
  Diagnosis& found_;
  std::map<std::uint64_t, std::optional<IntervalSet>> noted_;
  Statement studies_;
  Statement rows_;
  std::string name_;  // of the current study
  std::vector<std::string> study_faults_;
  std::vector<std::string> row_faults_;
  std::uint64_t all_rows_ = 0;
  std::uint64_t without_checksum_ = 0;
};

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

std::string row_fault_sql() {
  std::vector<std::string> lists;
  for (const solver::ResultList* list : solver::result_lists()) {
    lists.push_back(fmt::format("json_valid(coalesce({}, '[]'))", list->column));
  }
  return fmt::format(
      "CASE WHEN checksum <> {} THEN 'its row is not the one that was stored'"
      " WHEN NOT ({}) THEN 'one of its lists cannot be read'"
      " WHEN error IS NULL AND ({} IS NULL) THEN 'it is solved, and outputs are missing'"
      " WHEN error IS NOT NULL AND coalesce({}) IS NOT NULL"
      " THEN 'it is failed, and has outputs' END",
      result_checksum_sql(), fmt::join(lists, " AND "),
      fmt::join(required_outputs(), " IS NULL OR "), fmt::join(output_columns(), ", "));
}

Diagnosis diagnose_contents(sqlite3* database) {
  Diagnosis found;
  found.faults = faults_of_tables(database);
  if (!found.faults.empty()) {
    return found;  // the other checks need all tables
  }
  for (const std::string table : {"results", "completed_ranges", "retries", "reused_points"}) {
    append(found.faults, database,
           fmt::format("SELECT DISTINCT 'table {0}: refers to study number ' || study_id ||"
                       " ', which does not exist' FROM {0} WHERE study_id NOT IN"
                       " (SELECT study_id FROM studies UNION SELECT study_id FROM deletions)",
                       table));
  }
  append(found.faults, faults_of_models(database));
  append(found.remarks, database,
         "SELECT count(*) || ' results of deleted studies are left; the next server deletes them'"
         " FROM results WHERE study_id IN (SELECT study_id FROM deletions) HAVING count(*) > 0");
  StudyCheck(database, found).run();
  return found;
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
  add_row_checksum(database);
  execute(database, "BEGIN");  // so that rows and counts agree while a server writes
  for (const std::string& view : missing_views(database)) {
    found.faults.push_back(
        fmt::format("the view {} is missing: the next server on this file creates it", view));
  }
  for (const std::string& trigger : other_triggers(database)) {
    found.faults.push_back(fmt::format(
        "the trigger {} is not ours: no server works on this file until it is dropped", trigger));
  }
  Diagnosis contents = diagnose_contents(database);
  std::move(contents.faults.begin(), contents.faults.end(), std::back_inserter(found.faults));
  std::move(contents.remarks.begin(), contents.remarks.end(), std::back_inserter(found.remarks));
  return found;
}

std::vector<std::string> find_faults(const std::string& path) {
  return diagnose(path).faults;
}

}  // namespace oblique::server
