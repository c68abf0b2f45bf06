#include "server/maintenance/salvage.h"

#include <filesystem>
#include <stdexcept>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/database/draft_file.h"
#include "server/database/open_for_reading.h"
#include "server/database/row_checksum.h"
#include "server/database/sqlite.h"
#include "server/maintenance/check.h"
#include "server/maintenance/study_counts.h"
#include "server/store/completed_ranges.h"
#include "server/store/store.h"

namespace oblique::server {
namespace {

/// Throws StorageError unless the list of tables can be read.
void check_tables(sqlite3* database, const std::string& path) {
  try {
    if (identify(database, path) != DatabaseKind::kEmpty) {
      return;
    }
  } catch (const StorageError&) {
    if ((static_cast<unsigned>(sqlite3_errcode(database)) & 0xffU) != SQLITE_CORRUPT) {
      throw;
    }
    throw StorageError(path +
                       " is damaged where it says what tables it has: nothing can be salvaged");
  }
  throw StorageError(path + " is empty: no study was ever stored in it");
}

std::vector<std::string> texts(sqlite3* database, const std::string& sql) {
  Statement rows(database, sql);
  std::vector<std::string> found;
  while (rows.step()) {
    found.push_back(rows.text(0));
  }
  return found;
}

/// Rows of one table that have ascending integer keys.
struct KeyedRows {
  std::string table;
  std::string key = "rowid";
  std::string condition = "1";    ///< which rows are copied, in SQL
  std::string is_sound = "1";     ///< false for a damaged row, in SQL
  std::int64_t before_first = 0;  ///< smaller than every key
};

/// Inserts the columns of a row after the first two. False when the row violates the schema, so it
/// is damaged. Throws std::runtime_error when the copy cannot be written.
bool insert_row(sqlite3* to, Statement& insert, const Statement& row) {
  for (int column = 2; column < row.columns(); ++column) {
    insert.bind_column(column - 1, row, column);
  }
  try {
    insert.run();
    return true;
  } catch (const StorageError&) {
    const auto code = static_cast<unsigned>(sqlite3_errcode(to)) & 0xffU;
    if (code != SQLITE_CONSTRAINT && code != SQLITE_MISMATCH) {
      throw std::runtime_error("the copy cannot be written: is there room on its disk?");
    }
    insert.reset();
    return false;
  }
}

/// Copies the readable rows in the order of their keys and returns their number. After an
/// unreadable place it searches for the next readable row in growing leaps, so that a long place
/// costs few attempts and a short one few readable rows.
std::uint64_t copy_rows(sqlite3* from, sqlite3* to, const KeyedRows& rows, Salvaged& saved) {
  // Larger than every key that is used, so that no row can follow.
  constexpr std::int64_t kLongestLeap = std::int64_t{1} << 42U;
  const std::string columns_sql = "SELECT name FROM pragma_table_info('" + rows.table + "')";
  if (texts(from, columns_sql).empty()) {
    return 0;  // the table is lost
  }
  const std::vector<std::string> columns = texts(to, columns_sql);
  Statement read(
      from,
      fmt::format("SELECT {0}, {1}, {2} FROM {3} WHERE {4} AND {0} > ? ORDER BY {0}", rows.key,
                  rows.is_sound, fmt::join(columns, ", "), rows.table, rows.condition));
  Statement insert(
      to, fmt::format("INSERT INTO {} ({}) VALUES ({})", rows.table, fmt::join(columns, ", "),
                      fmt::join(std::vector<std::string>(columns.size(), "?"), ", ")));
  std::uint64_t copied = 0;
  std::int64_t last = rows.before_first;
  std::int64_t end_of_leap = last;
  for (std::int64_t leap = 0; leap <= kLongestLeap;) {
    try {
      read.reset();
      read.bind(1, last);
      while (read.step()) {
        last = read.integer(0);
        const bool is_copied = read.integer(1) != 0 && insert_row(to, insert, read);
        ++(is_copied ? copied : saved.unreadable_places);
      }
      break;
    } catch (const StorageError&) {  // a damaged page
      const bool is_new_place = leap == 0 || last != end_of_leap;
      saved.unreadable_places += is_new_place ? 1U : 0U;
      leap = is_new_place ? 1 : 2 * leap;
      last += leap;
      end_of_leap = last;
    }
  }
  return copied;
}

/// Copies the tables, each after those that it refers to.
void copy_tables(sqlite3* from, sqlite3* to, Salvaged& saved) {
  saved.studies = copy_rows(from, to, {.table = "studies"}, saved);
  for (const std::string table : {"models", "workers", "retries"}) {
    copy_rows(from, to, {.table = table}, saved);
  }
  // Rows of lost studies are not copied, because they have no meaning without the recipe.
  for (const std::string& study : texts(to, "SELECT study_id FROM studies")) {
    copy_rows(from, to,
              {.table = "results",
               .key = "point",
               .condition = "study_id = " + study,
               .is_sound = row_fault_sql() + " IS NULL",
               .before_first = -1},
              saved);
    copy_rows(from, to,
              {.table = "completed_ranges",
               .key = "first_point",
               .condition = "study_id = " + study,
               .before_first = -1},
              saved);
  }
}

/// Removes or repairs references to rows that were lost, and counts rows again.
void mend_references(sqlite3* database) {
  execute(database,
          "DELETE FROM results WHERE model_id NOT IN (SELECT model_id FROM models);"
          "DELETE FROM retries WHERE study_id NOT IN (SELECT study_id FROM studies);"
          // Rows keep the number of a lost worker, so that their checksums stay right. If all other
          // workers have one solver version, it is used for the lost worker too.
          "INSERT INTO workers"
          " (worker_id, name, threads, solver_version, instruction_set, joined_at)"
          " SELECT DISTINCT worker_id, 'lost with a damaged file', 1,"
          " (SELECT CASE count(DISTINCT solver_version) WHEN 1 THEN min(solver_version)"
          " ELSE 'unknown' END FROM workers), 'unknown', '' FROM results"
          " WHERE worker_id IS NOT NULL AND worker_id NOT IN (SELECT worker_id FROM workers);"
          "UPDATE studies SET counted = 1;");
  CompletedRanges ranges(database);
  Statement studies(database, "SELECT study_id, recipe, points FROM studies");
  while (studies.step()) {
    const auto study_id = static_cast<std::uint64_t>(studies.integer(0));
    const StudyTable table(studies.text(1), static_cast<std::uint64_t>(studies.integer(2)));
    ranges.count_again(study_id, table);
    count_reused_and_set_state(database, study_id);
  }
}

}  // namespace

Salvaged salvage(const std::string& from, const std::string& to) {
  if (std::filesystem::exists(to)) {
    throw StorageError(to + " exists already: name a file that does not");
  }
  const DatabaseHandle source = open_for_reading(from).database;
  // So that SQLite reads a file that is shorter than its first page says.
  execute(source.get(), "PRAGMA writable_schema = ON");
  check_tables(source.get(), from);
  add_row_checksum(source.get());
  DraftFile draft(to + ".part");
  Salvaged saved;
  { const Store with_schema(draft.path()); }
  {
    const DatabaseHandle target = open_database(draft.path(), SQLITE_OPEN_READWRITE);
    Transaction transaction(target.get());
    copy_tables(source.get(), target.get(), saved);
    mend_references(target.get());
    transaction.commit();
    saved.results = std::stoull(texts(target.get(), "SELECT count(*) FROM results").at(0));
    execute(target.get(), "PRAGMA journal_mode = DELETE");
  }
  draft.keep_as(to);
  return saved;
}

}  // namespace oblique::server
