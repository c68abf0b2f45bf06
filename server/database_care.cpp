#include "server/database_care.h"

#include <filesystem>

#include "server/draft_file.h"
#include "server/result_row.h"
#include "server/row_checksum.h"
#include "server/sqlite.h"

namespace oblique::server {
namespace {

constexpr int kBusyTimeout_ms = 5000;

DatabaseHandle open_ours(const std::string& path) {
  check_path(path);
  if (!std::filesystem::exists(path)) {
    throw StorageError("there is no database " + path);
  }
  DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
  sqlite3_busy_timeout(database.get(), kBusyTimeout_ms);
  if (identify(database.get(), path) == DatabaseKind::kEmpty) {
    throw StorageError(path + " is empty: no study was ever stored in it");
  }
  return database;
}

std::vector<std::string> texts(sqlite3* database, const std::string& sql) {
  std::vector<std::string> found;
  Statement statement(database, sql);
  while (statement.step()) {
    found.push_back(statement.text(0));
  }
  return found;
}

std::vector<std::string> damaged_pages(sqlite3* database) {
  try {
    auto found = texts(database, "PRAGMA integrity_check(20)");
    return found == std::vector<std::string>{"ok"} ? std::vector<std::string>{} : found;
  } catch (const StorageError& error) {
    return {error.what()};  // too damaged to be looked at
  }
}

void copy_pages(sqlite3* from, sqlite3* to, const std::string& path) {
  sqlite3_backup* backup = sqlite3_backup_init(to, "main", from, "main");
  if (backup == nullptr) {
    throw StorageError("cannot write the copy " + path + ": " + sqlite3_errmsg(to));
  }
  // All pages in one step: one instant of the source, whatever is written to it meanwhile.
  sqlite3_backup_step(backup, -1);
  if (sqlite3_backup_finish(backup) != SQLITE_OK) {
    throw StorageError("cannot write the copy " + path + ": " + sqlite3_errmsg(to));
  }
}

}  // namespace

void back_up(const std::string& from, const std::string& to) {
  if (std::filesystem::exists(to)) {
    throw StorageError(to + " exists already: name a file that does not");
  }
  const DatabaseHandle source = open_ours(from);
  DraftFile draft(to + ".part");
  {
    const DatabaseHandle copy =
        open_database(draft.path(), SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    copy_pages(source.get(), copy.get(), to);
    // One file, without a log beside it.
    execute(copy.get(), "PRAGMA journal_mode = DELETE");
    if (const auto faults = damaged_pages(copy.get()); !faults.empty()) {
      throw StorageError(from + " is damaged, and so would be the copy: " + faults.front());
    }
  }
  draft.keep_as(to);
}

std::vector<std::string> find_faults(const std::string& path) {
  const DatabaseHandle database = open_ours(path);
  auto faults = damaged_pages(database.get());
  const auto add = [&](const std::string& sql) {
    for (auto& fault : texts(database.get(), sql)) {
      faults.push_back(std::move(fault));
    }
  };
  if (!faults.empty()) {
    return faults;  // what damaged pages say of anything else means nothing
  }
  add("SELECT 'table ' || \"table\" || ', row ' || rowid || ': refers to a row of ' || parent ||"
      " ' that is not there' FROM pragma_foreign_key_check LIMIT 20");
  add("SELECT 'study ' || name || ': ' || count(*) || ' results of points that it does not have'"
      " FROM results JOIN studies USING (study_id) WHERE point < 0 OR point >= points"
      " GROUP BY study_id LIMIT 20");
  add("SELECT 'study ' || name || ' is called done with ' || (SELECT count(*) FROM results AS r"
      " WHERE r.study_id = s.study_id) || ' of ' || points || ' results' FROM studies AS s"
      " WHERE state = 'done' AND points <> (SELECT count(*) FROM results AS r"
      " WHERE r.study_id = s.study_id) LIMIT 20");
  if (identify(database.get(), path) == DatabaseKind::kOurs) {
    add_row_checksum(database.get());
    add("SELECT 'study ' || study_id || ', ' || name || ': its recipe, name or size is not the one"
        " that was stored' FROM studies"
        " WHERE checksum <> row_checksum(study_id, name, recipe, points, created_at) LIMIT 20");
    add("SELECT 'study ' || study_id || ', point ' || point || ': its row is not the one that was"
        " stored' FROM results WHERE checksum <> " +
        result_checksum_sql() + " LIMIT 20");
  }
  return faults;
}

}  // namespace oblique::server
