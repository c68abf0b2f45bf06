#include "server/care/salvage.h"

#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/care/merged_origins.h"
#include "server/care/table_columns.h"
#include "server/database/draft_file.h"
#include "server/database/open_for_reading.h"
#include "server/database/row_checksum.h"
#include "server/database/sqlite.h"
#include "server/store/rows/packed_row.h"
#include "server/store/rows/row_columns.h"
#include "server/store/rows/settled_runs.h"
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

/// The copy could not take a row: damaged, or there is no room for it.
void note_refused(sqlite3* to, std::uint64_t& unreadable) {
  const auto code = static_cast<unsigned>(sqlite3_errcode(to)) & 0xffU;
  if (code != SQLITE_CONSTRAINT && code != SQLITE_MISMATCH) {
    throw SaveError();
  }
  ++unreadable;
}

/// Copies rows in the order of a number that each has, and passes over what cannot be read.
class RowsCopy {
 public:
  virtual ~RowsCopy() = default;

  std::uint64_t rows() const { return rows_; }
  std::uint64_t unreadable_places() const { return unreadable_; }

  /// From behind that number on.
  void run(std::int64_t last) {
    last_ = last;
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

 protected:
  /// A query of the rows behind its last parameter, whose number is its first column.
  virtual Statement& read_behind(std::int64_t last) = 0;
  /// Copies the present row; false when it is not as it was stored. Throws StorageError when the
  /// copy does not take it.
  virtual bool copy(Statement& row) = 0;
  /// Makes ready for the next row after that.
  virtual void give_up() = 0;

  explicit RowsCopy(sqlite3* to) : to_(to) {}

 private:
  /// True at the end of the table.
  bool copy_until_unreadable() {
    copied_since_ = false;
    Statement& row = read_behind(last_);
    try {
      while (row.step()) {
        last_ = row.integer(0);
        copied_since_ = true;
        copy_row(row);
      }
      row.reset();
      return true;
    } catch (const StorageError&) {
      return false;
    }
  }

  /// A row that the schema does not take is damaged, too.
  void copy_row(Statement& row) {
    try {
      ++(copy(row) ? rows_ : unreadable_);
    } catch (const StorageError&) {
      note_refused(to_, unreadable_);
      give_up();
    }
  }

  sqlite3* to_;
  /// No table has so many rows: behind such a leap is nothing.
  static constexpr std::int64_t kLongestLeap = std::int64_t{1} << 42U;
  std::int64_t last_ = 0;
  bool copied_since_ = false;
  std::uint64_t rows_ = 0;
  std::uint64_t unreadable_ = 0;
};

/// All of a table, but of packed_results.
class TableCopy final : public RowsCopy {
 public:
  TableCopy(sqlite3* from, sqlite3* to, const std::string& table)
      : RowsCopy(to),
        columns_(common_columns(from, to, table)),
        read_(from, "SELECT rowid, " + soundness_sql(table) + ", " + columns_ + " FROM " + table +
                        " WHERE rowid > ? ORDER BY rowid"),
        insert_(to, "INSERT INTO " + table + " (" + columns_ + ") VALUES (" + marks() + ")") {}

 private:
  /// Words that others took the place of would say wrong things of many rows.
  static std::string soundness_sql(const std::string& table) {
    if (table != "texts" && table != "workers") {
      return "1";
    }
    return "(checksum IS NULL OR checksum = " +
           (table == "texts" ? text_checksum_sql() : worker_checksum_sql()) + ")";
  }

  std::string marks() const {
    std::string text = "?";
    for (const char letter : columns_) {
      text += letter == ',' ? ", ?" : "";
    }
    return text;
  }

  Statement& read_behind(std::int64_t last) override {
    read_.reset();
    read_.bind(1, last);
    return read_;
  }
  bool copy(Statement& row) override {
    if (row.integer(1) == 0) {
      return false;
    }
    for (int column = 2; column < row.columns(); ++column) {
      insert_.bind_column(column - 1, row, column);
    }
    insert_.run();
    return true;
  }
  void give_up() override { insert_.reset(); }

  std::string columns_;
  Statement read_;
  Statement insert_;
};

/// The results of one study.
class PackedCopy final : public RowsCopy {
 public:
  PackedCopy(sqlite3* from, sqlite3* to, std::int64_t study)
      : RowsCopy(to),
        study_(study),
        read_(from, fmt::format("SELECT point, {} AND {}, checksum IS NOT NULL, {} FROM"
                                " packed_results WHERE study_id = ?1 AND point > ?2 ORDER BY point",
                                result_soundness_sql(), lists_are_sound_sql(),
                                fmt::join(packed_columns(), ", "))),
        insert_(to) {}

 private:
  Statement& read_behind(std::int64_t last) override {
    read_.reset();
    read_.bind(1, study_);
    read_.bind(2, last);
    return read_;
  }
  bool copy(Statement& row) override {
    packed_.read(row, 3);
    return row.integer(1) != 0 && insert_.run(packed_, row.integer(2) != 0);
  }
  void give_up() override { insert_.give_up(); }

  std::int64_t study_;
  Statement read_;
  RowInsert insert_;
  PackedRow packed_;
};

std::vector<std::int64_t> studies_in(sqlite3* database) {
  Statement list(database, "SELECT study_id FROM studies");
  std::vector<std::int64_t> studies;
  while (list.step()) {
    studies.push_back(list.integer(0));
  }
  return studies;
}

/// Copies the results of all studies that were saved. Those of others tell nothing.
void copy_results(sqlite3* from, sqlite3* to, Salvaged& saved) {
  for (const std::int64_t study : studies_in(to)) {
    PackedCopy copy(from, to, study);
    copy.run(-1);  // points are counted from 0
    saved.unreadable_places += copy.unreadable_places();
  }
}

/// Copies the tables, each after those that it refers to.
void copy_tables(sqlite3* from, sqlite3* to, Salvaged& saved) {
  for (const std::string table : {"studies", "models", "workers", "texts", "retries", "origins"}) {
    if (columns_of(from, table).empty()) {
      continue;  // it was lost
    }
    TableCopy copy(from, to, table);
    copy.run(0);  // SQLite counts rows from 1
    saved.unreadable_places += copy.unreadable_places();
    saved.studies += table == "studies" ? copy.rows() : 0;
  }
  copy_results(from, to, saved);
}

void count_rows(sqlite3* database) {
  SettledRuns settled(database);
  for (const std::int64_t study : studies_in(database)) {
    settled.count_again(static_cast<std::uint64_t>(study));
    count_taken_points(database, static_cast<std::uint64_t>(study));
  }
}

/// No study that comes later may have a number by which rows know the study that they come from,
/// whether that was deleted or could not be read.
void keep_numbers(sqlite3* database) {
  execute(database,
          "DELETE FROM origins WHERE origin_id NOT IN (SELECT study_id FROM studies)"
          " AND origin_id NOT IN (SELECT origin_id FROM taken_points)");
  execute(database,
          "UPDATE about SET last_study_id ="
          " max(last_study_id, coalesce((SELECT max(origin_id) FROM origins), 0))");
}

/// Makes an end of what refers to rows that were not saved.
void mend_references(sqlite3* database) {
  // Rows of a study or model that is gone tell nothing, nor do those whose words are lost.
  execute(database,
          "DELETE FROM packed_results WHERE study_id NOT IN (SELECT study_id FROM studies)"
          " OR model_id NOT IN (SELECT model_id FROM models)"
          " OR (mode IS NOT NULL AND mode NOT IN (SELECT text_id FROM texts))"
          " OR (major_mode IS NOT NULL AND major_mode NOT IN (SELECT text_id FROM texts))"
          " OR (margin_event IS NOT NULL AND margin_event NOT IN (SELECT text_id FROM texts))");
  execute(database, "DELETE FROM retries WHERE study_id NOT IN (SELECT study_id FROM studies)");
  // A worker's number that is known to be right stays, so that the row keeps its checksum. Of a
  // lost worker's solver nothing is known but that databases mostly have results of one version.
  execute(
      database,
      "INSERT INTO workers (worker_id, name, threads, solver_version, instruction_set, joined_at)"
      " SELECT DISTINCT worker, 'lost with a damaged file', 1,"
      " (SELECT CASE count(DISTINCT solver_version) WHEN 1 THEN min(solver_version)"
      " ELSE 'unknown' END FROM workers), 'unknown', '' FROM packed_results"
      " WHERE worker NOT IN (SELECT worker_id FROM workers)");
  count_rows(database);
  keep_numbers(database);
  execute(database,
          "UPDATE studies SET state = 'running' WHERE state = 'done' AND points <>"
          " (SELECT coalesce(sum(p.points), 0) FROM settled_points AS p"
          " WHERE p.study_id = studies.study_id)");
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
  DraftFile draft(to + ".part");
  Salvaged saved;
  { const Store with_schema(draft.path()); }
  {
    const DatabaseHandle target = open_database(draft.path(), SQLITE_OPEN_READWRITE);
    add_row_checksum(target.get());
    Transaction transaction(target.get());
    copy_tables(source.get(), target.get(), saved);
    mend_references(target.get());
    transaction.commit();
    Statement count(target.get(), "SELECT count(*) FROM packed_results");
    count.step();
    saved.results = static_cast<std::uint64_t>(count.integer(0));
    count.reset();
    execute(target.get(), "PRAGMA journal_mode = DELETE");
  }
  draft.keep_as(to);
  return saved;
}

}  // namespace oblique::server
