#include "server/care/table_columns.h"

#include <algorithm>

#include "server/store/rows/row_columns.h"

namespace oblique::server {

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
  Statement list(database, "SELECT study_id FROM deletions");
  while (list.step()) {
    studies.insert(static_cast<std::uint64_t>(list.integer(0)));
  }
  return studies;
}

std::string result_soundness_sql() {
  return "(checksum IS NULL OR checksum = " + result_checksum_sql() + ")";
}

}  // namespace oblique::server
