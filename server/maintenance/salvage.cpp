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

std::vector<std::string> columns_of(sqlite3* database, const std::string& table) {
  return texts(database, "SELECT name FROM pragma_table_info('" + table + "')");
}

/// Rows of one table that have ascending integer keys.
struct KeyedRows {
  std::string table;
  std::string key = "rowid";
  std::string condition = "1";    ///< which rows are copied, in SQL
  std::string is_sound = "1";     ///< false for a damaged row, in SQL
  std::int64_t before_first = 0;  ///< all keys are above
};

/// Copies the rows of a table in the order of their keys, without what cannot be read.
class RowsCopy {
 public:
  RowsCopy(sqlite3* from, sqlite3* to, const KeyedRows& rows)
      : to_(to),
        columns_(columns_of(to, rows.table)),
        last_(rows.before_first),
        read_(from, fmt::format("SELECT {}, {}, {} FROM {} WHERE {} AND {} > ? ORDER BY {}",
                                rows.key, rows.is_sound, fmt::join(columns_, ", "), rows.table,
                                rows.condition, rows.key, rows.key)),
        insert_(to, fmt::format("INSERT INTO {} ({}) VALUES (?{})", rows.table,
                                fmt::join(columns_, ", "), marks())) {}

  std::uint64_t copied() const { return copied_; }
  std::uint64_t unreadable_places() const { return unreadable_; }

  /// After an unreadable place the next readable row is sought in growing leaps, so that a long
  /// place costs few attempts and a short one few readable rows.
  void run() {
    // No table has this many rows: behind such a leap is nothing.
    constexpr std::int64_t kLongestLeap = std::int64_t{1} << 42U;
    std::int64_t leap = 0;
    std::int64_t end_of_leap = last_;
    while (!copy_until_unreadable()) {
      const bool is_new_place = leap == 0 || last_ != end_of_leap;
      unreadable_ += is_new_place ? 1U : 0U;
      leap = is_new_place ? 1 : 2 * leap;
      if (leap > kLongestLeap) {
        return;
      }
      last_ += leap;
      end_of_leap = last_;
    }
  }

 private:
  std::string marks() const {
    std::string marks;
    for (std::size_t i = 1; i < columns_.size(); ++i) {
      marks += ", ?";
    }
    return marks;
  }

  /// True at the end of the table.
  bool copy_until_unreadable() {
    read_.reset();
    read_.bind(1, last_);
    while (true) {
      try {
        if (!read_.step()) {
          return true;
        }
      } catch (const StorageError&) {
        return false;
      }
      last_ = read_.integer(0);
      ++(read_.integer(1) != 0 && insert() ? copied_ : unreadable_);
    }
  }

  /// False when the row violates the schema, which makes it damaged. Throws std::runtime_error when
  /// the copy cannot be written.
  bool insert() {
    for (int column = 2; column < read_.columns(); ++column) {
      insert_.bind_column(column - 1, read_, column);
    }
    try {
      insert_.run();
      return true;
    } catch (const StorageError&) {
      const auto code = static_cast<unsigned>(sqlite3_errcode(to_)) & 0xffU;
      if (code != SQLITE_CONSTRAINT && code != SQLITE_MISMATCH) {
        throw std::runtime_error("the copy cannot be written: is there room on its disk?");
      }
      insert_.reset();
      return false;
    }
  }

  sqlite3* to_;
  std::vector<std::string> columns_;
  std::int64_t last_;
  Statement read_;
  Statement insert_;
  std::uint64_t copied_ = 0;
  std::uint64_t unreadable_ = 0;
};

/// Returns how many rows were copied.
std::uint64_t copy_rows(sqlite3* from, sqlite3* to, const KeyedRows& rows, Salvaged& saved) {
  if (columns_of(from, rows.table).empty()) {
    return 0;  // the table is lost
  }
  RowsCopy copy(from, to, rows);
  copy.run();
  saved.unreadable_places += copy.unreadable_places();
  return copy.copied();
}

/// Copies the tables, each after those that it refers to.
void copy_tables(sqlite3* from, sqlite3* to, Salvaged& saved) {
  saved.studies = copy_rows(from, to, {.table = "studies"}, saved);
  for (const std::string table : {"models", "workers", "retries"}) {
    copy_rows(from, to, {.table = table}, saved);
  }
  // Rows of a study that was lost mean nothing.
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
          // The number of a lost worker stays, so that the row keeps its checksum. Databases mostly
          // have results of one solver version; otherwise that of a lost worker is unknown.
          "INSERT INTO workers"
          " (worker_id, name, threads, solver_version, instruction_set, joined_at)"
          " SELECT DISTINCT worker_id, 'lost with a damaged file', 1,"
          " (SELECT CASE count(DISTINCT solver_version) WHEN 1 THEN min(solver_version)"
          " ELSE 'unknown' END FROM workers), 'unknown', '' FROM results"
          " WHERE worker_id IS NOT NULL AND worker_id NOT IN (SELECT worker_id FROM workers);"
          "UPDATE studies SET counted = 1;");
  const auto noted = noted_points(database);
  Statement studies(database, "SELECT study_id, recipe, points FROM studies");
  while (studies.step()) {
    const auto study_id = static_cast<std::uint64_t>(studies.integer(0));
    const StudyTable table(studies.text(1), static_cast<std::uint64_t>(studies.integer(2)));
    count_again(database, study_id, table, noted.at(study_id).value());
  }
}

}  // namespace

Salvaged salvage(const std::string& from, const std::string& to) {
  if (std::filesystem::exists(to)) {
    throw StorageError(to + " exists already: name a file that does not");
  }
  const DatabaseHandle source = open_for_reading(from).database;
  // A file that is shorter than its first page says can be read as far as it goes.
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
