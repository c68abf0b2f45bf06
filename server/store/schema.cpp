#include "server/store/schema.h"

#include <random>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/store/schema_sql.h"

namespace oblique::server {
namespace {

const std::vector<std::string>& our_views() {
  static const std::vector<std::string> kNames{"runs", "peaks", "phases", "stick_intervals",
                                               "reaction_peaks"};
  return kNames;
}

std::vector<std::string> names(sqlite3* database, const std::string& sql) {
  std::vector<std::string> found;
  Statement statement(database, sql);
  while (statement.step()) {
    found.push_back(statement.text(0));
  }
  return found;
}

std::vector<std::string> missing(sqlite3* database, const std::string& type,
                                 const std::vector<std::string>& expected) {
  std::vector<std::string> absent;
  Statement find(database,
                 "SELECT 1 FROM sqlite_schema WHERE type = ? AND name = ? COLLATE NOCASE");
  for (const std::string& name : expected) {
    find.bind(1, type);
    find.bind(2, name);
    if (!find.step()) {
      absent.push_back(name);
    }
    find.reset();
  }
  return absent;
}

std::string random_id() {
  std::random_device source;
  std::string id;
  for (int i = 0; i < 4; ++i) {
    id += fmt::format("{:08x}", source());
  }
  return id;
}

}  // namespace

void create_tables(sqlite3* database) {
  Transaction transaction(database);
  execute(database, kSchemaSql);
  execute(database, fmt::format("PRAGMA application_id = {}", kApplicationId));
  execute(database, fmt::format("PRAGMA user_version = {}", kSchemaVersion));
  Statement about(database, "INSERT INTO about (database_id) VALUES (?)");
  about.bind(1, random_id());
  about.run();
  transaction.commit();
}

void create_views(sqlite3* database) {
  Transaction transaction(database);
  execute(database, kViewsSql);
  transaction.commit();
}

const std::vector<TableDefinition>& our_tables() {
  static const std::vector<TableDefinition> kTables = [] {
    const DatabaseHandle database = open_database(":memory:", SQLITE_OPEN_READWRITE);
    execute(database.get(), kSchemaSql);
    std::vector<TableDefinition> tables;
    Statement list(database.get(), "SELECT name, sql FROM sqlite_schema WHERE type = 'table'");
    while (list.step()) {
      tables.push_back({list.text(0), list.text(1)});
    }
    return tables;
  }();
  return kTables;
}

std::vector<std::string> missing_tables(sqlite3* database) {
  std::vector<std::string> names;
  for (const TableDefinition& table : our_tables()) {
    names.push_back(table.name);
  }
  return missing(database, "table", names);
}

std::vector<std::string> missing_views(sqlite3* database) {
  return missing(database, "view", our_views());
}

std::vector<std::string> other_triggers(sqlite3* database) {
  constexpr std::size_t kLongestName = 80;
  std::vector<std::string> found =
      names(database,
            "SELECT name FROM sqlite_schema WHERE type = 'trigger' AND (name, tbl_name) <>"
            " ('row_deleted', 'results') ORDER BY rowid");
  for (std::string& name : found) {
    name = protocol::visible(protocol::shortened(name, kLongestName));
  }
  return found;
}

std::string last_study_id_sql() {
  std::string numbers = "SELECT last_study_id AS number FROM about";
  for (const std::string_view table :
       {"studies", "results", "completed_ranges", "retries", "deletions", "reused_points"}) {
    numbers += fmt::format(" UNION ALL SELECT max(study_id) FROM {}", table);
  }
  return "(SELECT coalesce(max(number), 0) FROM (" + numbers + "))";
}

}  // namespace oblique::server
