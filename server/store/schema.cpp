#include "server/store/schema.h"

#include <map>

#include <spdlog/fmt/fmt.h>

#include "server/store/schema_sql.h"

namespace oblique::server {
namespace {

/// Returns SQLite's description of a table: kind and columns, but no defaults and checks.
std::string description(sqlite3* database, const std::string& table) {
  Statement text(database,
                 "SELECT (SELECT type || wr || strict FROM pragma_table_list"
                 " WHERE schema = 'main' AND name = ?1) || group_concat("
                 "name || ' ' || type || ' ' || \"notnull\" || pk || hidden)"
                 " FROM pragma_table_xinfo(?1, 'main')");
  text.bind_all(table);
  return text.step() ? text.text(0) : "";
}

const std::map<std::string, std::string>& our_tables() {
  static const std::map<std::string, std::string> kTables = [] {
    const DatabaseHandle database = open_database(":memory:", SQLITE_OPEN_READWRITE);
    execute(database.get(), kSchemaSql);
    std::map<std::string, std::string> tables;
    Statement list(
        database.get(),
        "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite_%'");
    while (list.step()) {
      tables[list.text(0)] = description(database.get(), list.text(0));
    }
    return tables;
  }();
  return kTables;
}

}  // namespace

void create_tables(sqlite3* database) {
  Transaction transaction(database);
  execute(database, kSchemaSql);
  execute(database, fmt::format("PRAGMA application_id = {}", kApplicationId));
  execute(database, fmt::format("PRAGMA user_version = {}", kSchemaVersion));
  execute(database, "INSERT INTO about DEFAULT VALUES");
  transaction.commit();
}

void create_views(sqlite3* database) {
  Transaction transaction(database);
  execute(database, kViewsSql);
  transaction.commit();
}

std::vector<std::string> differing_tables(sqlite3* database) {
  std::vector<std::string> names;
  for (const auto& [table, columns] : our_tables()) {
    if (description(database, table) != columns) {
      names.push_back(table);
    }
  }
  return names;
}

}  // namespace oblique::server
