#include "server/store/schema/schema_setup.h"

#include <random>
#include <regex>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/store/schema/schema.h"

namespace oblique::server {
namespace {

const std::vector<std::string>& our_views() {
  static const std::vector<std::string> kNames{
      "results", "runs", "peaks", "phases", "stick_intervals", "reaction_peaks"};
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
  execute(database, kResultsSql);
  execute(database, fmt::format("PRAGMA application_id = {}", kApplicationId));
  execute(database, fmt::format("PRAGMA user_version = {}", kSchemaVersion));
  Statement about(database, "INSERT INTO about (database_id) VALUES (?)");
  about.bind(1, random_id());
  about.run();
  transaction.commit();
}

void create_views(sqlite3* database) {
  Transaction transaction(database);
  for (const std::string& view : our_views()) {
    execute(database, "DROP VIEW IF EXISTS " + view);
  }
  execute(database, kViewsSql);
  execute(database, kTriggersSql);
  transaction.commit();
}

void create_temporary_views(sqlite3* database) {
  execute(database, std::regex_replace(kViewsSql, std::regex("CREATE VIEW"), "CREATE TEMP VIEW"));
}

const std::vector<std::string>& our_tables() {
  static const std::vector<std::string> kNames = [] {
    const DatabaseHandle database = open_database(":memory:", SQLITE_OPEN_READWRITE);
    execute(database.get(), kSchemaSql);
    execute(database.get(), kResultsSql);
    return names(database.get(), "SELECT name FROM sqlite_schema WHERE type = 'table'");
  }();
  return kNames;
}

std::vector<std::string> missing_tables(sqlite3* database) {
  return missing(database, "table", our_tables());
}

std::vector<std::string> missing_views(sqlite3* database) {
  return missing(database, "view", our_views());
}

std::vector<std::string> other_triggers(sqlite3* database) {
  constexpr std::size_t kLongestName = 80;
  std::vector<std::string> found =
      names(database,
            "SELECT name FROM sqlite_schema WHERE type = 'trigger' AND (name, tbl_name) NOT IN"
            " (VALUES ('rows_are_gone', 'packed_results'), ('delete_results', 'results'),"
            " ('update_results', 'results')) ORDER BY rowid");
  for (std::string& name : found) {
    name = protocol::visible(protocol::shortened(name, kLongestName));
  }
  return found;
}

}  // namespace oblique::server
