#include "server/store/schema.h"

#include <algorithm>
#include <random>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/store/schema_sql.h"

namespace oblique::server {
namespace {

/// A row of `sqlite_schema`.
struct SchemaObject {
  std::string type;
  std::string name;
  std::string table;  ///< of an index or trigger
  std::string sql;

  bool operator==(const SchemaObject&) const = default;
};

std::vector<SchemaObject> objects_of(sqlite3* database) {
  std::vector<SchemaObject> objects;
  Statement list(database,
                 "SELECT type, name, tbl_name, sql FROM sqlite_schema"
                 " WHERE sql IS NOT NULL ORDER BY rowid");
  while (list.step()) {
    objects.push_back({list.text(0), list.text(1), list.text(2), list.text(3)});
  }
  return objects;
}

const std::vector<SchemaObject>& our_objects() {
  static const std::vector<SchemaObject> kObjects = [] {
    const DatabaseHandle database = open_database(":memory:", SQLITE_OPEN_READWRITE);
    execute(database.get(), kSchemaSql);
    execute(database.get(), kViewsSql);
    return objects_of(database.get());
  }();
  return kObjects;
}

std::vector<std::string> missing(sqlite3* database, const std::string& type) {
  std::vector<std::string> absent;
  Statement find(database,
                 "SELECT 1 FROM sqlite_schema WHERE type = ? AND name = ? COLLATE NOCASE");
  for (const SchemaObject& object : our_objects()) {
    if (object.type != type) {
      continue;
    }
    find.bind(1, type);
    find.bind(2, object.name);
    if (!find.step()) {
      absent.push_back(object.name);
    }
    find.reset();
  }
  return absent;
}

bool is_ours(const SchemaObject& object) {
  return std::ranges::find(our_objects(), object) != our_objects().end();
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
  // While the trigger was missing, rows may have been deleted without notice.
  const auto objects = objects_of(database);
  const bool had_our_trigger = std::ranges::any_of(objects, [](const SchemaObject& object) {
    return object.type == "trigger" && is_ours(object);
  });
  execute(database, kViewsSql);
  if (!had_our_trigger) {  // no foreign trigger is left that could run with this
    execute(database, "UPDATE studies SET counted = 0");
  }
  transaction.commit();
}

const std::vector<TableDefinition>& our_tables() {
  static const std::vector<TableDefinition> kTables = [] {
    std::vector<TableDefinition> tables;
    for (const SchemaObject& object : our_objects()) {
      if (object.type == "table") {
        tables.push_back({object.name, object.sql});
      }
    }
    return tables;
  }();
  return kTables;
}

std::vector<std::string> missing_tables(sqlite3* database) {
  return missing(database, "table");
}

std::vector<std::string> missing_views(sqlite3* database) {
  return missing(database, "view");
}

std::vector<std::string> other_triggers(sqlite3* database) {
  constexpr std::size_t kLongestName = 80;
  std::vector<std::string> found;
  for (const SchemaObject& object : objects_of(database)) {
    if (object.type == "trigger" && !is_ours(object)) {
      found.push_back(protocol::visible(protocol::shortened(object.name, kLongestName)));
    }
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
