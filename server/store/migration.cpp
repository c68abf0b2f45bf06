#include "server/store/migration.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string_view>
#include <system_error>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/store/migrated_rows.h"
#include "server/store/rows/model_rows.h"
#include "server/store/rows/old_additions.h"
#include "server/store/rows/row_columns.h"
#include "server/store/schema/schema.h"
#include "server/store/schema/standing_views.h"

namespace oblique::server {
namespace {

using Notice = std::function<void(const std::string&)>;

/// Measured on one core of a machine of 2025.
constexpr double kRowsPerSecond = 50'000.0;
/// Below so many rows nobody need be told to wait.
constexpr std::uint64_t kManyRows = 100'000;

std::string random_id() {
  std::random_device source;
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string id;
  for (int i = 0; i < 32; ++i) {
    id += kDigits[source() % kDigits.size()];
  }
  return id;
}

std::int64_t number(sqlite3* database, const std::string& sql) {
  Statement statement(database, sql);
  return statement.step() ? statement.integer(0) : 0;
}

double megabytes(sqlite3* database) {
  return static_cast<double>(number(database, "PRAGMA page_count")) *
         static_cast<double>(number(database, "PRAGMA page_size")) / 1e6;
}

void tell(const Notice& notice, const std::string& sentence) {
  if (notice) {
    notice(sentence);
  }
}

/// What the disk needs meanwhile beside the file as it is: the new rows twice, in the log and
/// behind the old ones, while they take less than half of these. Measured: 0.73 of the file for a
/// million rows, a little more than 1 for ten thousand.
double wanted_MB(sqlite3* database) {
  return 1.25 * megabytes(database);
}

/// " of which 12 MB are free", or nothing where that cannot be told.
std::string free_room(const std::string& path) {
  std::error_code error;
  const auto folder = std::filesystem::absolute(path, error).parent_path();
  const auto space = std::filesystem::space(folder, error);
  return error ? ""
               : fmt::format(" of which {:.0f} MB are free",
                             static_cast<double>(space.available) / 1e6);
}

/// Whether the disk, and not what the file holds, has brought it to an end.
bool is_want_of_room(const StorageError& error) {
  const std::string_view reason = error.what();
  return reason.find(sqlite3_errstr(SQLITE_FULL)) != std::string_view::npos ||
         reason.find(sqlite3_errstr(SQLITE_IOERR)) != std::string_view::npos;
}

void say_what_begins(sqlite3* database, int found, std::uint64_t rows, const Notice& notice) {
  tell(notice,
       fmt::format(
           "the database is brought from schema {} to {}, once, with about {} results: some "
           "{:.0f} s, and up to {:.0f} MB more on its disk meanwhile. Whoever ends it before loses "
           "nothing, and the next start begins again",
           found, kSchemaVersion, rows,
           std::max(1.0, 2.0 * static_cast<double>(rows) / kRowsPerSecond), wanted_MB(database)));
}

struct Steps {
  MigratedRows rows;
  std::vector<std::string> said;
};

/// The steps to schema `kFirstPacked`, in the open transaction.
Steps take_steps(sqlite3* database, int found, std::uint64_t rows, const Notice& notice) {
  constexpr std::array kSteps{kMigrateFrom1Sql, kMigrateFrom2Sql, kMigrateFrom3Sql,
                              kMigrateFrom4Sql, kMigrateFrom5Sql, kMigrateFrom6Sql};
  static_assert(kSteps.size() == kSchemaVersion - 2, "a step from each schema to the next");
  for (std::size_t step = static_cast<std::size_t>(found); step <= kSteps.size(); ++step) {
    execute(database, kSteps.at(step - 1));
  }
  OldAdditions additions(database);
  std::vector<std::string> more = additions.names();
  more.emplace_back("results_7");
  if (const std::string taken = names_in_the_way(database, more); !taken.empty()) {
    throw StorageError(taken);
  }
  execute(database, kMigrateFrom7Sql);
  execute(database, kResultsSql);
  const MigratedRows migrated = migrate_rows(database, [&](std::uint64_t looked_at) {
    if (rows >= kManyRows && looked_at % (rows / 10 / 10'000 * 10'000) == 0) {
      tell(notice, fmt::format("{} of about {} results", looked_at, rows));
    }
  });
  Steps steps{migrated, additions.keep("results_7")};
  execute(database, "DROP TABLE results_7");
  execute(database, kViewsSql);
  const auto failing = views_that_fail(database);
  steps.said.insert(steps.said.end(), failing.begin(), failing.end());
  return steps;
}

}  // namespace

void create_schema(sqlite3* database) {
  Transaction transaction(database);
  execute(database, kSchemaSql);
  execute(database, kResultsSql);
  execute(database, kViewsSql);
  execute(database, "PRAGMA application_id = " + std::to_string(kApplicationId));
  execute(database, "PRAGMA user_version = " + std::to_string(kSchemaVersion));
  Statement about(database, "INSERT INTO about (database_id) VALUES (?)");
  about.bind(1, random_id());
  about.run();
  transaction.commit();
}

void migrate(sqlite3* database, const Notice& notice) {
  add_model_definition(database);
  const auto found = static_cast<int>(number(database, "PRAGMA user_version"));
  const std::string path = sqlite3_db_filename(database, "main");
  const double wanted = wanted_MB(database);
  try {
    const auto rows =
        static_cast<std::uint64_t>(number(database, "SELECT max(rowid) FROM results"));
    say_what_begins(database, found, rows, notice);
    Transaction transaction(database);
    const auto [migrated, said] = take_steps(database, found, rows, notice);
    execute(database, "PRAGMA user_version = " + std::to_string(kSchemaVersion));
    transaction.commit();
    tell(notice, fmt::format("{} results are brought over", migrated.kept));
    if (migrated.left_out > 0) {
      tell(notice, fmt::format("{} results were not as they were stored: they are left out, and "
                               "their points are solved again",
                               migrated.left_out));
    }
    for (const std::string& sentence : said) {
      tell(notice, sentence);
    }
  } catch (const StorageGone&) {
    throw;
  } catch (const StorageError& error) {
    throw StorageError(fmt::format(
        "the database {} cannot be brought from schema {} to {}, and stays as it is: {}{}", path,
        found, kSchemaVersion, error.what(),
        is_want_of_room(error)
            ? fmt::format(
                  ". It takes up to {:.1f} MB more on its disk meanwhile,{}: make room, and "
                  "start again",
                  wanted, free_room(path))
            : ""));
  }
}

bool gives_space_back(sqlite3* database) {
  constexpr std::int64_t kIncremental = 2;
  return number(database, "PRAGMA auto_vacuum") == kIncremental;
}

void make_it_give_space_back(sqlite3* database, const Notice& notice) {
  const double before_MB = megabytes(database);
  try {
    execute(database, "PRAGMA auto_vacuum = INCREMENTAL");
    execute(database, "VACUUM");
    tell(notice, fmt::format("the database was written again without its empty pages: {:.1f} MB, "
                             "from {:.1f} MB",
                             megabytes(database), before_MB));
  } catch (const StorageError& error) {
    tell(notice, fmt::format("the database keeps its empty pages, and cannot give back space until "
                             "a start can write it again: {}",
                             error.what()));
  }
}

}  // namespace oblique::server
