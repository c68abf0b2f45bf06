#include "server/store/schema.h"

#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "server/database/database_file.h"
#include "server/store/schema_sql.h"

namespace oblique::server {
namespace {

std::vector<SchemaElement> elements_of(sqlite3* database) {
  Statement list(database, "SELECT type, name, tbl_name, coalesce(sql, '') FROM sqlite_schema");
  std::vector<SchemaElement> found;
  while (list.step()) {
    found.push_back({list.text(0), list.text(1), list.text(2), list.text(3)});
  }
  return found;
}

void execute_schema(sqlite3* database) {
  execute(database, kViewsSql);
  execute(database, kSchemaSql);
}

}  // namespace

void create_tables(sqlite3* database) {
  Transaction transaction(database);
  execute_schema(database);
  execute(database, fmt::format("PRAGMA application_id = {}", kApplicationId));
  execute(database, fmt::format("PRAGMA user_version = {}", kSchemaVersion));
  execute(database, "INSERT INTO about DEFAULT VALUES");
  transaction.commit();
}

SchemaDifferences compare_schema(sqlite3* database) {
  static const std::vector<SchemaElement> kOurs = [] {
    const DatabaseHandle empty = open_database(":memory:", SQLITE_OPEN_READWRITE);
    execute_schema(empty.get());
    return elements_of(empty.get());
  }();
  SchemaDifferences found{kOurs, elements_of(database)};
  std::erase_if(found.lacking, [&](const SchemaElement& element) {
    return std::ranges::count(found.foreign, element.name, &SchemaElement::name) == 1 &&
           std::ranges::count(found.foreign, element) == 1;
  });
  // The indices and triggers of a missing table are missing, too.
  if (std::ranges::count(found.lacking, "table", &SchemaElement::type) > 0) {
    std::erase_if(found.lacking, [](const auto& element) { return element.type != "table"; });
  }
  // SQLite makes an index without a statement for each constraint that needs one.
  std::erase_if(found.foreign, [](const SchemaElement& element) {
    return element.sql.empty() || std::ranges::count(kOurs, element) > 0;
  });
  return found;
}

std::string fault_of(const SchemaElement& lacking) {
  return fmt::format(
      "the {} {} is missing or was changed, so answers may be wrong: {}`oblique backup SAVED.db "
      "--db FILE --salvage` makes a file with all readable rows",
      lacking.type, lacking.name,
      lacking.type == "table" ? "" : "any server, as of `oblique view`, makes it again, and ");
}

DatabaseHandle open_with_schema(const std::string& path) {
  DatabaseHandle database = open_stored(path);
  for (const SchemaElement& element : compare_schema(database.get()).lacking) {
    throw StorageError(fmt::format("in {} {}", path, fault_of(element)));
  }
  return database;
}

void restore_schema(sqlite3* database, const std::string& path) {
  Transaction transaction(database);
  for (const SchemaElement& element : compare_schema(database).lacking) {
    if (element.type == "table") {
      throw StorageError(fmt::format("in {} {}", path, fault_of(element)));
    }
    try {
      execute(database, fmt::format("DROP {} IF EXISTS {}", element.type, element.name));
      execute(database, element.sql);
    } catch (const ChangeRefused& error) {
      throw StorageError(
          fmt::format("in {} the {} {} cannot be made again: {}. If a table has this "
                      "name, rename the table",
                      path, element.type, element.name, error.what()));
    }
  }
  transaction.commit();
}

}  // namespace oblique::server
