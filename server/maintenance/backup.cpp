#include "server/maintenance/backup.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "server/database/database_file.h"
#include "server/database/sqlite.h"
#include "server/maintenance/check.h"
#include "server/store/completed_ranges.h"
#include "server/store/result_rows.h"
#include "server/store/schema.h"
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

std::vector<std::string> columns_of(sqlite3* database, const std::string& table) {
  return texts(database, "SELECT name FROM pragma_table_info('" + table + "')");
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
  const std::vector<std::string> found = columns_of(from, rows.table);
  std::vector<std::string> columns;
  std::vector<std::string> lost;  // missing columns; if there are any, rows get no checksum
  for (const std::string& column : columns_of(to, rows.table)) {
    (std::ranges::count(found, column) > 0 ? columns : lost).push_back(column);
  }
  if (!lost.empty()) {
    saved.losses.insert(
        fmt::format("the table {} has lost the columns {}", rows.table, fmt::join(lost, ", ")));
  }
  if (columns.empty()) {
    return 0;  // the table itself is lost
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
  if (saved.unreadable_places > 0) {
    saved.losses.insert("studies, models or workers are lost, with all results that need them");
  }
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
  try {
    for (const std::string& study : texts(from, "SELECT DISTINCT study_id FROM results")) {
      if (texts(to, "SELECT 1 FROM studies WHERE study_id = " + study).empty()) {
        saved.losses.insert(fmt::format("study {} is lost, with all its results", study));
      }
    }
  } catch (const StorageError&) {  // a damaged page, which is counted above
  }
}

/// Renames and pauses each study whose recipe, models or workers do not match their checksums,
/// because its results may mean other points. Then clears these checksums.
void set_changed_studies_aside(sqlite3* database, Salvaged& saved) {
  const std::string changed = fmt::format(
      " WHERE checksum <> {} OR study_id IN (SELECT study_id FROM results WHERE model_id IN"
      " (SELECT model_id FROM models WHERE checksum <> {}) OR worker_id IN"
      " (SELECT worker_id FROM workers WHERE checksum <> {}))",
      kStudyChecksum, model_checksum_sql(), kWorkerChecksum);
  for (std::string& loss :
       texts(database,
             "SELECT 'study ' || study_id || ', ' || name || ': its recipe, a model or a worker was"
             " changed after it was stored, so its results may mean other points. It is paused and"
             " called \"damaged study ' || study_id || '\" now' FROM studies" +
                 changed)) {
    saved.losses.insert(std::move(loss));
  }
  execute(database, fmt::format("UPDATE studies SET name = 'damaged study ' || study_id,"
                                " state = 'paused'{};"
                                "UPDATE studies SET checksum = NULL WHERE checksum <> {};"
                                "UPDATE models SET checksum = NULL WHERE checksum <> {};"
                                "UPDATE workers SET checksum = NULL WHERE checksum <> {};",
                                changed, kStudyChecksum, model_checksum_sql(), kWorkerChecksum));
}

/// Removes or repairs references to lost rows, and counts completed points.
void mend(sqlite3* database, Salvaged& saved) {
  execute(database, "DELETE FROM results WHERE model_id NOT IN (SELECT model_id FROM models)");
  if (const int lost = sqlite3_changes(database); lost > 0) {
    saved.losses.insert(fmt::format("{} results are lost, because their model is", lost));
  }
  execute(database,
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

/// Lets SQLite read a file that is shorter than its header states, and every table whose definition
/// it can parse.
void ignore_damaged_schema(sqlite3* database) {
  execute(database, "PRAGMA writable_schema = ON");
  // If a definition cannot be parsed, the first statement fails, and later ones use the others.
  sqlite3_exec(database, "SELECT 1 FROM sqlite_schema", nullptr, nullptr, nullptr);
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

/// Opens a damaged file: a copy of its pages in `draft` or, if a page cannot be read, the file
/// itself. In the copy all tables have our definitions, because a damaged one makes rows unreadable
/// or gives columns wrong names; rows store values by their place. A table with another number of
/// columns keeps its definition. `ours` has our tables.
DatabaseHandle open_damaged(const std::string& from, const DraftFile& draft, sqlite3* ours) {
  DatabaseHandle source = open_for_reading(from);
  ignore_damaged_schema(source.get());
  check_is_salvageable(source.get(), from);
  try {
    DatabaseHandle copy = open_database(draft.path(), SQLITE_OPEN_READWRITE);
    copy_pages(source.get(), copy.get(), draft.path());
    ignore_damaged_schema(copy.get());
    for (const SchemaElement& element : compare_schema(copy.get()).lacking) {
      const auto columns = columns_of(copy.get(), element.name).size();
      if (element.type == "table" &&
          (columns == 0 || columns == columns_of(ours, element.name).size())) {
        execute_with(copy.get(),
                     "UPDATE sqlite_schema SET type = 'table', name = ?1, tbl_name = ?1, sql = ?2"
                     " WHERE rootpage > 0 AND type <> 'index' AND (name = ?1 OR sql = ?2)",
                     element.name, element.sql);
      }
    }
    execute(copy.get(),
            "DELETE FROM sqlite_schema WHERE type <> 'table' AND sql IS NOT NULL;"
            "PRAGMA writable_schema = RESET");
    ignore_damaged_schema(copy.get());
    return copy;
  } catch (const StorageError&) {
    return source;
  }
}

}  // namespace

std::vector<std::string> copy_into(const DraftFile& draft, const std::string& from,
                                   const std::string& to) {
  // Maximum size of a stored value. Values arrive in messages, whose size is limited.
  constexpr int kLongestValue = static_cast<int>(2 * protocol::kMaxFrameBytes);
  const DatabaseHandle source = open_with_schema(from);
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
  sqlite3_limit(copy.get(), SQLITE_LIMIT_LENGTH, kLongestValue);
  return diagnose_contents(copy.get()).faults;
}

std::vector<std::string> back_up(const std::string& from, const std::string& to) {
  check_is_new(to);
  const DraftFile draft(to + ".part");
  auto faults = copy_into(draft, from, to);
  draft.keep_as(to);
  return faults;
}

Salvaged salvage(const std::string& from, const std::string& to) {
  check_is_new(to);
  const DraftFile draft(to + ".part");
  const DraftFile pages(to + ".pages");
  Salvaged saved;
  {
    Store target(draft.path());
    const DatabaseHandle source = open_damaged(from, pages, target.connection());
    target.write([&] {
      copy_tables(source.get(), target.connection(), saved);
      set_changed_studies_aside(target.connection(), saved);
      mend(target.connection(), saved);
    });
    for (std::string& fault : diagnose_contents(target.connection()).faults) {
      saved.losses.insert(std::move(fault));
    }
    saved.results = std::stoull(texts(target.connection(), "SELECT count(*) FROM results").at(0));
    execute(target.connection(), "PRAGMA journal_mode = DELETE");
  }
  draft.keep_as(to);
  return saved;
}

}  // namespace oblique::server
