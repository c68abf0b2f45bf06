#include "server/care/database_care.h"

#include <cstddef>
#include <filesystem>
#include <utility>

#include "server/care/row_faults.h"
#include "server/database/draft_file.h"
#include "server/database/open_for_reading.h"
#include "server/database/row_checksum.h"
#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostOfAKind = 20;

OpenedForReading open_ours(const std::string& path) {
  OpenedForReading opened = open_for_reading(path);
  if (identify(opened.database.get(), path) == DatabaseKind::kEmpty) {
    throw StorageError(path + " is empty: no study was ever stored in it");
  }
  return opened;
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

int schema_of(sqlite3* database) {
  Statement version(database, "PRAGMA user_version");
  return version.step() ? static_cast<int>(version.integer(0)) : 0;
}

/// Every study beside the number of its results, for FROM.
std::string counted_studies() {
  return "(SELECT *, (SELECT count(*) FROM results AS r WHERE r.study_id = s.study_id) AS results"
         " FROM studies AS s)";
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
  const OpenedForReading source = open_ours(from);
  DraftFile draft(to + ".part");
  {
    const DatabaseHandle copy =
        open_database(draft.path(), SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    copy_pages(source.database.get(), copy.get(), to);
    // One file, without a log beside it.
    execute(copy.get(), "PRAGMA journal_mode = DELETE");
    if (const auto faults = damaged_pages(copy.get()); !faults.empty()) {
      throw StorageError(from + " is damaged, and so would be the copy: " + faults.front());
    }
  }
  draft.keep_as(to);
}

Diagnosis diagnose(const std::string& path) {
  const OpenedForReading opened = open_ours(path);
  sqlite3* database = opened.database.get();
  Diagnosis found;
  if (!opened.remark.empty()) {
    found.remarks.push_back(opened.remark);
  }
  found.faults = damaged_pages(database);
  if (!found.faults.empty()) {
    return found;  // what damaged pages say of anything else means nothing
  }
  add_row_checksum(database);
  const auto add = [&](std::vector<std::string>& to, const std::string& sql) {
    for (auto& text : texts(database, sql)) {
      to.push_back(std::move(text));
    }
  };
  add(found.faults,
      "SELECT 'table ' || \"table\" || ', row ' || rowid || ': refers to a row of ' || parent ||"
      " ' that is not there' FROM pragma_foreign_key_check LIMIT 20");
  add(found.faults,
      "SELECT 'study ' || name || ': ' || count(*) || ' results of points that it does not have'"
      " FROM results JOIN studies USING (study_id) WHERE point < 0 OR point >= points"
      " GROUP BY study_id LIMIT 20");
  add(found.faults,
      "SELECT 'study ' || name || ' is called done with ' || results || ' of ' || points ||"
      " ' results' FROM " +
          counted_studies() +
          " WHERE state = 'done' AND results <> points"
          " LIMIT 20");
  const int schema = schema_of(database);
  for (auto& fault : faults_of_rows(database, schema, kMostOfAKind)) {
    found.faults.push_back(std::move(fault));
  }
  add(found.remarks,
      "SELECT 'study ' || name || ' is ' || state || ': ' || results || ' of ' || points ||"
      " ' points have a result' FROM " +
          counted_studies() +
          " WHERE results < points"
          " ORDER BY study_id");
  if (schema == kSchemaVersion) {
    add(found.remarks,
        "SELECT count(*) || ' of ' || (SELECT count(*) FROM results) || ' results have no checksum,"
        " for they are of an earlier schema: a flipped bit in them may go unseen'"
        " FROM results WHERE checksum IS NULL HAVING count(*) > 0");
  }
  return found;
}

std::vector<std::string> find_faults(const std::string& path) {
  return diagnose(path).faults;
}

}  // namespace oblique::server
