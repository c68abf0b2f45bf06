#include "server/care/salvage.h"

#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "server/care/table_columns.h"
#include "server/database/draft_file.h"
#include "server/database/open_for_reading.h"
#include "server/database/row_checksum.h"
#include "server/database/sqlite.h"
#include "server/store/model_rows.h"
#include "server/store/store.h"

namespace oblique::server {
namespace {

/// The copy cannot be written, whatever can be read.
class SaveError : public std::runtime_error {
 public:
  SaveError() : std::runtime_error("the copy cannot be written: is there room on its disk?") {}
};

/// Throws StorageError unless the tables can be found.
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

/// Says of each row of the table whether it is as it was written, as far as that can be told.
std::string soundness_sql(sqlite3* database, const std::string& table) {
  return table == "results" ? result_soundness_sql(schema_of(database)) : "1";
}

/// Copies the rows of one table in the order of their numbers, and passes over what cannot be read.
class TableCopy {
 public:
  TableCopy(sqlite3* from, sqlite3* to, const std::string& table)
      : to_(to),
        columns_(common_columns(from, to, table)),
        read_(from, "SELECT rowid, " + soundness_sql(from, table) + ", " +
                        present_values_sql(schema_of(from), table, columns_) + " FROM " + table +
                        " WHERE rowid > ? ORDER BY rowid"),
        insert_(to, "INSERT INTO " + table + " (" + columns_ + ") VALUES (" + marks() + ")") {}

  std::uint64_t rows() const { return rows_; }
  std::uint64_t unreadable_places() const { return unreadable_; }

  void run() {
    // After an unreadable place the next readable row is sought in growing leaps, so that a long
    // one costs little and a short one takes few rows with it.
    std::int64_t leap = 0;
    while (!copy_until_unreadable()) {
      const bool is_new_place = copied_since_ || leap == 0;
      unreadable_ += is_new_place ? 1U : 0U;
      leap = is_new_place ? 1 : 2 * leap;
      if (leap > kLongestLeap) {
        return;
      }
      last_ += leap;
    }
  }

 private:
  std::string marks() const {
    std::string text = "?";
    for (const char letter : columns_) {
      text += letter == ',' ? ", ?" : "";
    }
    return text;
  }

  /// True at the end of the table.
  bool copy_until_unreadable() {
    copied_since_ = false;
    read_.reset();
    read_.bind(1, last_);
    try {
      while (read_.step()) {
        last_ = read_.integer(0);
        copied_since_ = true;
        insert_row();
      }
      read_.reset();
      return true;
    } catch (const StorageError&) {
      return false;
    }
  }

  /// A row that the schema does not take is damaged, too.
  void insert_row() {
    if (read_.integer(1) == 0) {
      ++unreadable_;
      return;
    }
    try {
      for (int column = 2; column < read_.columns(); ++column) {
        insert_.bind_column(column - 1, read_, column);
      }
      insert_.run();
      ++rows_;
    } catch (const StorageError&) {
      const auto code = static_cast<unsigned>(sqlite3_errcode(to_)) & 0xffU;
      if (code != SQLITE_CONSTRAINT && code != SQLITE_MISMATCH) {
        throw SaveError();
      }
      insert_.reset();
      ++unreadable_;
    }
  }

  sqlite3* to_;
  std::string columns_;
  Statement read_;
  Statement insert_;
  /// No table has so many rows: behind such a leap is nothing.
  static constexpr std::int64_t kLongestLeap = std::int64_t{1} << 42U;
  std::int64_t last_ = 0;  // SQLite counts rows from 1
  bool copied_since_ = false;
  std::uint64_t rows_ = 0;
  std::uint64_t unreadable_ = 0;
};

/// The tables that are copied, each after those that it refers to.
std::vector<const char*> tables_of(sqlite3* database) {
  std::vector<const char*> tables{"studies", "models", "workers", "results"};
  if (!columns_of(database, "retries").empty()) {
    tables.push_back("retries");
  }
  return tables;
}

/// Makes an end of what refers to rows that were not saved.
void mend_references(sqlite3* database) {
  // Rows of a study or model that is gone tell nothing.
  execute(database,
          "DELETE FROM results WHERE study_id NOT IN (SELECT study_id FROM studies)"
          " OR model_id NOT IN (SELECT model_id FROM models)");
  execute(database, "DELETE FROM retries WHERE study_id NOT IN (SELECT study_id FROM studies)");
  // A worker's number that is known to be right stays, so that the row keeps its checksum.
  execute(
      database,
      "INSERT INTO workers SELECT worker, 'lost with a damaged file', 1, min(solver_version),"
      " min(instruction_set), min(solved_at) FROM results WHERE checksum IS NOT NULL"
      " AND worker IS NOT NULL AND worker NOT IN (SELECT worker_id FROM workers) GROUP BY worker");
  execute(database,
          "UPDATE results SET worker = NULL"
          " WHERE worker NOT IN (SELECT worker_id FROM workers)");
  execute(database,
          "UPDATE studies SET state = 'running' WHERE state = 'done' AND points <>"
          " (SELECT count(*) FROM results AS r WHERE r.study_id = studies.study_id)");
}

}  // namespace

Salvaged salvage(const std::string& from, const std::string& to) {
  if (std::filesystem::exists(to)) {
    throw StorageError(to + " exists already: name a file that does not");
  }
  const DatabaseHandle source = open_for_reading(from).database;
  // Also what is shorter than its first page says can be read, as far as it goes.
  execute(source.get(), "PRAGMA writable_schema = ON");
  check_tables(source.get(), from);
  add_row_checksum(source.get());
  add_model_definition(source.get());
  DraftFile draft(to + ".part");
  Salvaged saved;
  { const Store with_schema(draft.path()); }
  {
    const DatabaseHandle target = open_database(draft.path(), SQLITE_OPEN_READWRITE);
    Transaction transaction(target.get());
    for (const char* table : tables_of(source.get())) {
      TableCopy copy(source.get(), target.get(), table);
      copy.run();
      saved.unreadable_places += copy.unreadable_places();
      saved.studies += table == std::string_view("studies") ? copy.rows() : 0;
    }
    mend_references(target.get());
    transaction.commit();
    Statement count(target.get(), "SELECT count(*) FROM results");
    count.step();
    saved.results = static_cast<std::uint64_t>(count.integer(0));
    count.reset();
    execute(target.get(), "PRAGMA journal_mode = DELETE");
  }
  draft.keep_as(to);
  return saved;
}

}  // namespace oblique::server
