#include "server/store/rows/old_additions.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "server/store/rows/row_columns.h"

namespace oblique::server {
namespace {

/// Columns of `packed_results` that hold what those of that name held before.
constexpr std::array<std::string_view, 10> kSameColumns{
    "study_id", "point", "model_id", "H", "mu", "e", "error", "worker", "steps", "attempt"};

std::string in_quotes(std::string_view name) {
  std::string text = "\"";
  for (const char letter : name) {
    text += letter == '"' ? "\"\"" : std::string(1, letter);
  }
  return text + '"';
}

}  // namespace

OldAdditions::OldAdditions(sqlite3* database) : database_(database) {
  const auto ours = result_columns(kFirstPacked - 1);
  Statement columns(database_, "SELECT name FROM pragma_table_xinfo('results') ORDER BY cid");
  while (columns.step()) {
    const std::string name = columns.text(0);
    if (name != "checksum" && std::find(ours.begin(), ours.end(), name) == ours.end()) {
      columns_.push_back(name);
    }
  }
  find_indices();
  find_references();
}

void OldAdditions::find_references() {
  Statement tables(database_,
                   "SELECT DISTINCT t.name FROM sqlite_schema AS t"
                   " JOIN pragma_foreign_key_list(t.name) AS key WHERE t.type = 'table'"
                   " AND key.\"table\" = 'results' COLLATE NOCASE ORDER BY t.name");
  while (tables.step()) {
    referring_.push_back(tables.text(0));
  }
}

std::vector<std::string> OldAdditions::names() const {
  std::vector<std::string> names;
  if (!columns_.empty()) {
    names = {"added_columns", "added_columns_by_point"};
  }
  if (std::any_of(indices_.begin(), indices_.end(),
                  [](const Index& index) { return index.columns.empty(); })) {
    names.emplace_back("added_before_8");
  }
  return names;
}

void OldAdditions::find_indices() {
  Statement list(database_,
                 "SELECT i.name, s.sql, i.\"unique\" OR i.partial FROM pragma_index_list('results')"
                 " AS i JOIN sqlite_schema AS s ON s.type = 'index' AND s.name = i.name"
                 " WHERE i.origin = 'c' AND i.name <> 'failed_points' ORDER BY i.name");
  while (list.step()) {
    const bool is_plain = list.integer(2) == 0;
    indices_.push_back(
        {list.text(0), list.text(1), is_plain ? packed_columns_of(list.text(0)) : std::string()});
  }
}

/// Empty: the table that comes does not have them all.
std::string OldAdditions::packed_columns_of(const std::string& index) {
  Statement columns(database_,
                    "SELECT name, \"desc\", coll FROM pragma_index_xinfo(?) WHERE key"
                    " ORDER BY seqno");
  columns.bind(1, std::string_view(index));
  std::string text;
  while (columns.step()) {
    const std::string name = columns.text(0);  // of an expression: NULL
    if (std::find(kSameColumns.begin(), kSameColumns.end(), name) == kSameColumns.end()) {
      return {};
    }
    text += fmt::format("{}{} COLLATE {}{}", text.empty() ? "" : ", ", name,
                        in_quotes(columns.text(2)), columns.integer(1) != 0 ? " DESC" : "");
  }
  return text;
}

std::vector<std::string> OldAdditions::keep(const std::string& table) {
  std::vector<std::string> said;
  keep_columns(table, said);
  keep_indices(said);
  for (const std::string& name : referring_) {
    said.push_back(
        fmt::format("the table {} has a foreign key to results, which is a view now: its rows are "
                    "kept, but nothing checks that key, and a program with PRAGMA foreign_keys = "
                    "ON cannot write into it until it is made again without",
                    name));
  }
  return said;
}

void OldAdditions::keep_columns(const std::string& table, std::vector<std::string>& said) {
  if (columns_.empty()) {
    return;
  }
  std::vector<std::string> names;
  std::string any_value = "0";
  for (const std::string& column : columns_) {
    names.push_back(in_quotes(column));
    any_value += " OR " + in_quotes(column) + " IS NOT NULL";
  }
  execute(database_, fmt::format("CREATE TABLE added_columns AS SELECT study_id, point, {} FROM {}"
                                 " WHERE {} ORDER BY study_id, point",
                                 fmt::join(names, ", "), table, any_value));
  execute(database_,
          "CREATE UNIQUE INDEX added_columns_by_point ON added_columns (study_id, point)");
  said.push_back(fmt::format(
      "columns that were added to results ({}) stand now in the table added_columns, by study_id "
      "and point",
      fmt::join(columns_, ", ")));
}

void OldAdditions::keep_indices(std::vector<std::string>& said) {
  for (const Index& index : indices_) {
    execute(database_, "DROP INDEX " + in_quotes(index.name));
    if (!index.columns.empty()) {
      execute(database_, fmt::format("CREATE INDEX {} ON packed_results ({})",
                                     in_quotes(index.name), index.columns));
    } else {
      note("index", index.name, index.sql);
      said.push_back(
          fmt::format("the index {} on results is gone, for the table behind it has other columns "
                      "now; its SQL stands in the table added_before_8",
                      index.name));
    }
  }
}

void OldAdditions::note(const char* kind, const std::string& name, const std::string& sql) {
  execute(database_,
          "CREATE TABLE IF NOT EXISTS added_before_8"
          " (kind TEXT NOT NULL, name TEXT NOT NULL, sql TEXT NOT NULL) STRICT");
  Statement insert(database_, "INSERT INTO added_before_8 VALUES (?, ?, ?)");
  insert.bind(1, std::string_view(kind));
  insert.bind(2, std::string_view(name));
  insert.bind(3, std::string_view(sql));
  insert.run();
}

std::vector<std::string> views_that_fail(sqlite3* database) {
  std::vector<std::string> said;
  Statement views(database, "SELECT name FROM sqlite_schema WHERE type = 'view' ORDER BY name");
  while (views.step()) {
    const std::string name = views.text(0);
    try {
      const Statement view(database, "SELECT * FROM " + in_quotes(name));
    } catch (const StorageError& error) {
      said.push_back(
          fmt::format("the view {} is kept, but cannot be read: {}", name, error.what()));
    }
  }
  return said;
}

}  // namespace oblique::server
