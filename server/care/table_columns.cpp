#include "server/care/table_columns.h"

#include <algorithm>
#include <string_view>

#include "server/store/rows/model_rows.h"
#include "server/store/rows/row_columns.h"

namespace oblique::server {

int schema_of(sqlite3* database) {
  Statement version(database, "PRAGMA user_version");
  return version.step() ? static_cast<int>(version.integer(0)) : 0;
}

std::vector<std::string> columns_of(sqlite3* database, const std::string& table) {
  Statement list(database, "SELECT name FROM pragma_table_info('" + table + "')");
  std::vector<std::string> names;
  while (list.step()) {
    names.push_back(list.text(0));
  }
  return names;
}

std::string common_columns(sqlite3* from, sqlite3* to, const std::string& table) {
  const auto there = columns_of(from, table);
  std::string list;
  for (const std::string& column : columns_of(to, table)) {
    if (std::find(there.begin(), there.end(), column) != there.end()) {
      list += (list.empty() ? "" : ", ") + column;
    }
  }
  return list;
}

std::set<std::uint64_t> deleted_studies(sqlite3* database) {
  std::set<std::uint64_t> studies;
  if (!columns_of(database, "deletions").empty()) {
    Statement list(database, "SELECT study_id FROM deletions");
    while (list.step()) {
      studies.insert(static_cast<std::uint64_t>(list.integer(0)));
    }
  }
  return studies;
}

std::string present_values_sql(int schema, const std::string& table, std::string columns) {
  if (constexpr std::string_view kColumn = "definition";
      table == "models" && schema < kFirstWithCanonicalModels) {
    columns.replace(columns.find(kColumn), kColumn.size(), "model_definition(definition)");
  }
  return columns;
}

std::string result_soundness_sql(int schema) {
  return schema < kFirstWithChecksums
             ? "1"
             : "(checksum IS NULL OR checksum = " + result_checksum_sql(schema) + ")";
}

}  // namespace oblique::server
