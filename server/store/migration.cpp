#include "server/store/migration.h"

#include <array>
#include <cstddef>
#include <random>
#include <string>
#include <string_view>

#include "server/store/model_rows.h"
#include "server/store/schema.h"

namespace oblique::server {
namespace {

std::string random_id() {
  std::random_device source;
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string id;
  for (int i = 0; i < 32; ++i) {
    id += kDigits[source() % kDigits.size()];
  }
  return id;
}

}  // namespace

void create_schema(sqlite3* database) {
  Transaction transaction(database);
  execute(database, kSchemaSql);
  execute(database, kViewsSql);
  execute(database, "PRAGMA application_id = " + std::to_string(kApplicationId));
  execute(database, "PRAGMA user_version = " + std::to_string(kSchemaVersion));
  Statement about(database, "INSERT INTO about (database_id) VALUES (?)");
  about.bind(1, random_id());
  about.run();
  transaction.commit();
}

void migrate(sqlite3* database) {
  constexpr std::array kSteps{kMigrateFrom1Sql, kMigrateFrom2Sql, kMigrateFrom3Sql,
                              kMigrateFrom4Sql, kMigrateFrom5Sql, kMigrateFrom6Sql};
  static_assert(kSteps.size() == kSchemaVersion - 1, "a step from each schema to the next");
  add_model_definition(database);
  Statement version(database, "PRAGMA user_version");
  version.step();
  const auto found = static_cast<std::size_t>(version.integer(0));
  version.reset();
  Transaction transaction(database);
  for (std::size_t step = found; step < kSchemaVersion; ++step) {
    execute(database, kSteps.at(step - 1));
  }
  execute(database, kViewsSql);
  execute(database, "PRAGMA user_version = " + std::to_string(kSchemaVersion));
  transaction.commit();
}

}  // namespace oblique::server
