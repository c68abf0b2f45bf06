#include "server/care/diagnosis.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/care/row_faults.h"
#include "server/care/table_columns.h"
#include "server/database/open_for_reading.h"
#include "server/database/row_checksum.h"
#include "server/database/sqlite.h"
#include "server/store/rows/settled_runs.h"
#include "server/store/schema/schema_setup.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostOfAKind = 20;

std::vector<std::string> texts(sqlite3* database, const std::string& sql) {
  std::vector<std::string> found;
  Statement statement(database, sql);
  while (statement.step()) {
    found.push_back(statement.text(0));
  }
  return found;
}

/// The lowest point that is in one of the sets alone; they differ.
std::uint64_t first_difference(const IntervalSet& a, const IntervalSet& b) {
  std::uint64_t point = 0;
  while (true) {
    const auto of_a = a.first_from(point);
    const auto of_b = b.first_from(point);
    if (!of_a || !of_b || of_a->begin != of_b->begin) {
      return std::min(of_a ? of_a->begin : of_b->begin, of_b ? of_b->begin : of_a->begin);
    }
    if (of_a->end != of_b->end) {
      return std::min(of_a->end, of_b->end);
    }
    point = of_a->end;
  }
}

/// Every study beside the number of its results, for FROM.
constexpr const char* kCountedStudies =
    "(SELECT *, (SELECT count(*) FROM packed_results AS r WHERE r.study_id = s.study_id)"
    " AS results FROM studies AS s)";

/// What the runs of settled points say that the rows do not. One instant of both, whatever a server
/// writes meanwhile.
void compare_settled_points(sqlite3* database, Diagnosis& found) {
  constexpr auto kLast = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  execute(database, "SAVEPOINT settled");
  const auto noted = noted_points(database);
  Statement studies(database, "SELECT study_id, name FROM studies ORDER BY study_id");
  while (studies.step()) {
    const auto id = static_cast<std::uint64_t>(studies.integer(0));
    const auto known = noted.find(id);
    if (known != noted.end() && !known->second) {
      found.remarks.push_back(
          fmt::format("study {}: another program deleted results; they are counted when a server "
                      "starts",
                      studies.text(1)));
      continue;
    }
    const IntervalSet said = known == noted.end() ? IntervalSet() : *known->second;
    const IntervalSet there = points_with_row(database, id, {0, kLast});
    if (!(said == there) && found.faults.size() < kMostOfAKind) {
      found.faults.push_back(fmt::format(
          "study {}: settled_points has {} points and results {}, and from point {} on not the "
          "same "
          "ones. UPDATE studies SET counted = 0 WHERE study_id = {} has them counted when a server "
          "starts",
          studies.text(1), said.size(), there.size(), first_difference(said, there), id));
    }
  }
  execute(database, "RELEASE settled");
}

/// Rows that refer to one that is not there, each table by itself: a table that other people made
/// may have a foreign key that cannot be checked. `which` is a condition in SQL on `parent`.
void check_references(sqlite3* database, const std::string& which, Diagnosis& found) {
  for (const std::string& table :
       texts(database, "SELECT name FROM sqlite_schema WHERE type = 'table' ORDER BY name")) {
    try {
      Statement rows(database,
                     "SELECT 'table ' || \"table\" || coalesce(', row ' || rowid, '') ||"
                     " ': refers to a row of ' || parent || ' that is not there'"
                     " FROM pragma_foreign_key_check(?) WHERE " +
                         which);
      rows.bind(1, table);
      while (found.faults.size() < kMostOfAKind && rows.step()) {
        found.faults.push_back(rows.text(0));
      }
    } catch (const StorageError& error) {
      const bool is_ours = std::count(our_tables().begin(), our_tables().end(), table) > 0;
      (is_ours ? found.faults : found.remarks)
          .push_back(fmt::format("the foreign keys of the table {} cannot be checked: {}", table,
                                 error.what()));
    }
  }
}

std::vector<std::string> faults_of_tables(sqlite3* database) {
  std::vector<std::string> faults;
  for (const std::string& table : missing_tables(database)) {
    faults.push_back(fmt::format(
        "the table {} is missing, and no server starts on this file: `oblique backup --salvage` "
        "makes one that has it, of all that can be read",
        table));
  }
  return faults;
}

void add_texts(std::vector<std::string>& to, sqlite3* database, const std::string& sql) {
  for (auto& text : texts(database, sql)) {
    to.push_back(std::move(text));
  }
}

/// Rows that refer to what is not there.
void check_references_of_rows(sqlite3* database, Diagnosis& found) {
  // Rows of a study that is being deleted refer to none.
  const bool deletes = !deleted_studies(database).empty();
  check_references(database, deletes ? "parent <> 'studies'" : "1", found);
  if (deletes) {
    add_texts(found.faults, database,
              "SELECT DISTINCT 'table packed_results: refers to study number ' || study_id ||"
              " ', which is not there' FROM packed_results WHERE study_id NOT IN"
              " (SELECT study_id FROM studies UNION SELECT study_id FROM deletions) LIMIT 20");
    add_texts(found.remarks, database,
              "SELECT count(*) || ' results of deleted studies are left; the next server deletes"
              " them' FROM packed_results WHERE study_id IN (SELECT study_id FROM deletions)"
              " HAVING count(*) > 0");
  }
}

}  // namespace

std::vector<std::string> faults_of_pages(sqlite3* database) {
  try {
    auto found = texts(database, "PRAGMA integrity_check(20)");
    return found == std::vector<std::string>{"ok"} ? std::vector<std::string>{} : found;
  } catch (const StorageError& error) {
    return {error.what()};  // too damaged to be looked at
  }
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
    return found;  // what damaged pages say of anything else means nothing
  }
  add_row_checksum(database);
  found.faults = faults_of_tables(database);
  if (!found.faults.empty()) {
    return found;  // what would be asked next needs them
  }
  check_references_of_rows(database, found);
  add_texts(found.faults, database,
            fmt::format("SELECT 'study ' || name || ' is called done with ' || results || ' of ' ||"
                        " points || ' results' FROM {} WHERE state = 'done' AND results <> points"
                        " LIMIT 20",
                        kCountedStudies));
  compare_settled_points(database, found);
  for (const std::string& view : missing_views(database)) {
    found.faults.push_back(
        fmt::format("the view {} is missing: the next server on this file creates it", view));
  }
  for (const std::string& trigger : other_triggers(database)) {
    found.faults.push_back(fmt::format(
        "the trigger {} is not ours: no server works on this file until it is dropped", trigger));
  }
  create_temporary_views(database);  // those of the file may be missing or not be ours
  for (auto& fault : faults_of_rows(database, kMostOfAKind)) {
    found.faults.push_back(std::move(fault));
  }
  add_texts(found.remarks, database,
            fmt::format("SELECT 'study ' || name || ' is ' || state || ': ' || results || ' of ' ||"
                        " points || ' points have a result' FROM {} WHERE results < points"
                        " ORDER BY study_id",
                        kCountedStudies));
  add_texts(found.remarks, database,
            "SELECT count(*) || ' of ' || (SELECT count(*) FROM packed_results) || ' results have"
            " no checksum: a flipped bit in them may go unseen'"
            " FROM packed_results WHERE checksum IS NULL HAVING count(*) > 0");
  return found;
}

std::vector<std::string> find_faults(const std::string& path) {
  return diagnose(path).faults;
}

}  // namespace oblique::server
