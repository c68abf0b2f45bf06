#include "server/maintenance/backup.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/database/database_file.h"
#include "server/database/sqlite.h"
#include "server/maintenance/check.h"
#include "server/store/completed_ranges.h"
#include "server/store/result_rows.h"
#include "server/store/store.h"

namespace oblique::server {
namespace {

void check_is_new(const std::string& path) {
  if (std::filesystem::exists(path)) {
    throw StorageError(path + " exists: choose another name");
  }
}

void copy_pages(sqlite3* from, sqlite3* to, const std::string& path) {
  sqlite3_backup* backup = sqlite3_backup_init(to, "main", from, "main");
  if (backup == nullptr) {
    throw StorageError("cannot write the copy " + path + ": " + sqlite3_errmsg(to));
  }
  // Copies all pages in one step, so that the copy is consistent even while a server writes.
  const int step = sqlite3_backup_step(backup, -1);
  const int end = sqlite3_backup_finish(backup);
  if (step != SQLITE_DONE || end != SQLITE_OK) {
    throw StorageError("cannot write the copy " + path + ": " +
                       sqlite3_errstr(end == SQLITE_OK ? step : end));
  }
}

// ---- Salvage ------------------------------------------------------------------------------------

std::vector<std::string> texts(sqlite3* database, const std::string& sql) {
  Statement rows(database, sql);
  std::vector<std::string> found;
  while (rows.step()) {
    found.push_back(rows.text(0));
  }
  return found;
}

/// A table with ascending integer keys, and the conditions for the rows to copy.
struct KeyedRows {
  std::string table;
  std::string key;
  std::string condition = "1";    ///< SQL condition that selects the rows to copy
  std::string is_sound = "1";     ///< SQL condition that is true for an undamaged row
  std::int64_t before_first = 0;  ///< a number below all keys
};

/// Inserts a row, without its first two columns (key and condition). Returns false if the row
/// violates the schema and is therefore damaged. Throws std::runtime_error if the copy cannot be
/// written.
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
      throw std::runtime_error("the copy cannot be written: is its disk full?");
    }
    insert.reset();
    return false;
  }
}

/// Copies the readable rows in the order of their keys and returns their number. After an
/// unreadable row, skips keys in steps that double, so that a long gap costs few attempts and a
/// short gap loses few readable rows.
std::uint64_t copy_rows(sqlite3* from, sqlite3* to, const KeyedRows& rows, Salvaged& saved) {
  // Maximum step, larger than every key in use.
  constexpr std::int64_t kLongestLeap = std::int64_t{1} << 42U;
  const std::string columns_sql = "SELECT name FROM pragma_table_info('" + rows.table + "')";
  const std::vector<std::string> found = texts(from, columns_sql);
  if (found.empty()) {
    return 0;  // the damaged file has lost the table
  }
  std::vector<std::string> columns;
  std::vector<std::string> lost;  // missing columns; if there are any, rows get no checksum
  for (const std::string& column : texts(to, columns_sql)) {
    (std::ranges::count(found, column) > 0 ? columns : lost).push_back(column);
  }
  if (!lost.empty() && std::erase(columns, "checksum") > 0) {
    lost.emplace_back("checksum");
  }
  const std::string source =
      lost.empty() ? rows.table
                   : fmt::format("(SELECT {}, NULL AS {} FROM {})", fmt::join(columns, ", "),
                                 fmt::join(lost, ", NULL AS "), rows.table);
  Statement read(
      from, fmt::format("SELECT {0}, {1}, {2} FROM {3} WHERE {4} AND {0} > ? ORDER BY {0}",
                        rows.key, rows.is_sound, fmt::join(columns, ", "), source, rows.condition));
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

void copy_tables(sqlite3* from, sqlite3* to, Salvaged& saved) {
  saved.studies = copy_rows(from, to, {.table = "studies", .key = "study_id"}, saved);
  copy_rows(from, to, {.table = "models", .key = "model_id"}, saved);
  copy_rows(from, to, {.table = "workers", .key = "worker_id"}, saved);
  // Skips results of lost studies, because results mean nothing without a recipe.
  for (const std::string& study : texts(to, "SELECT study_id FROM studies")) {
    copy_rows(from, to,
              {.table = "results",
               .key = "point",
               .condition = "study_id = " + study,
               .is_sound = row_fault_sql() + " IS NULL",
               .before_first = -1},
              saved);
  }
}

/// Removes or repairs references to lost rows, and counts completed points. Clears wrong checksums
/// of studies and models; `check` still compares results with recipes.
void mend(sqlite3* database) {
  execute(database, fmt::format("UPDATE studies SET checksum = NULL WHERE checksum <> {};"
                                "UPDATE models SET checksum = NULL WHERE checksum <> {};",
                                kStudyChecksum, model_checksum_sql()));
  execute(database,
          "DELETE FROM results WHERE model_id NOT IN (SELECT model_id FROM models);"
          // Results keep the number of a lost worker, so that their checksums stay right. If all
          // other workers have the same solver version, the lost worker gets this version too.
          "INSERT INTO workers"
          " (worker_id, name, threads, solver_version, instruction_set, joined_at)"
          " SELECT DISTINCT worker_id, 'lost with a damaged file', 1,"
          " (SELECT CASE count(DISTINCT solver_version) WHEN 1 THEN min(solver_version)"
          " ELSE 'unknown' END FROM workers), 'unknown', '' FROM results"
          " WHERE worker_id IS NOT NULL AND worker_id NOT IN (SELECT worker_id FROM workers);"
          "UPDATE studies SET counted = 0;");
  count_completed_points(database);
  for (const std::string& study : texts(database, "SELECT study_id FROM studies")) {
    update_counts_and_state(database, std::stoull(study));
  }
}

void check_is_salvageable(sqlite3* database, const std::string& path) {
  try {
    if (identify(database, path) != DatabaseKind::kEmpty) {
      return;
    }
  } catch (const StorageError&) {
    if ((static_cast<unsigned>(sqlite3_errcode(database)) & 0xffU) != SQLITE_CORRUPT) {
      throw;
    }
    throw StorageError(path + " has a damaged list of tables, so nothing can be salvaged");
  }
  throw StorageError(path + " is empty: it contains no study");
}

}  // namespace

void copy_into(const DraftFile& draft, const std::string& from, const std::string& to) {
  const DatabaseHandle source = open_stored(from);
  const DatabaseHandle copy =
      open_database(draft.path(), SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  copy_pages(source.get(), copy.get(), to);
  execute(copy.get(), "PRAGMA journal_mode = DELETE");
  // Studies of the copy and of the original may get the same numbers later. The new ID makes
  // workers drop results that are for the original.
  execute(copy.get(), "UPDATE about SET database_id = lower(hex(randomblob(16)))");
  if (const auto faults = faults_of_pages(copy.get()); !faults.empty()) {
    throw StorageError(from + " is damaged and was not copied: " + faults.front());
  }
}

void back_up(const std::string& from, const std::string& to) {
  check_is_new(to);
  const DraftFile draft(to + ".part");
  copy_into(draft, from, to);
  draft.keep_as(to);
}

Salvaged salvage(const std::string& from, const std::string& to) {
  check_is_new(to);
  const DatabaseHandle source = open_for_reading(from);
  // Makes SQLite read a file that is shorter than its header states.
  execute(source.get(), "PRAGMA writable_schema = ON");
  check_is_salvageable(source.get(), from);
  const DraftFile draft(to + ".part");
  Salvaged saved;
  {
    Store target(draft.path());
    target.write([&] {
      copy_tables(source.get(), target.connection(), saved);
      mend(target.connection());
    });
    saved.results = std::stoull(texts(target.connection(), "SELECT count(*) FROM results").at(0));
    execute(target.connection(), "PRAGMA journal_mode = DELETE");
  }
  draft.keep_as(to);
  return saved;
}

}  // namespace oblique::server
