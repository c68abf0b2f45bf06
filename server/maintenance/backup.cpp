#include "server/maintenance/backup.h"

#include <filesystem>

#include "server/database/open_for_reading.h"
#include "server/database/sqlite.h"
#include "server/maintenance/check.h"

namespace oblique::server {
namespace {

void copy_pages(sqlite3* from, sqlite3* to, const std::string& path) {
  sqlite3_backup* backup = sqlite3_backup_init(to, "main", from, "main");
  if (backup == nullptr) {
    throw StorageError("cannot write the copy " + path + ": " + sqlite3_errmsg(to));
  }
  // All pages in one step, so that the copy has one state of the source even if a server writes.
  sqlite3_backup_step(backup, -1);
  if (sqlite3_backup_finish(backup) != SQLITE_OK) {
    throw StorageError("cannot write the copy " + path + ": " + sqlite3_errmsg(to));
  }
}

}  // namespace

std::string copy_into(const DraftFile& draft, const std::string& from, const std::string& to) {
  const OpenedForReading source = open_stored(from);
  const DatabaseHandle copy =
      open_database(draft.path(), SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  copy_pages(source.database.get(), copy.get(), to);
  // So that the copy is one file, without a log.
  execute(copy.get(), "PRAGMA journal_mode = DELETE");
  if (const auto faults = faults_of_pages(copy.get()); !faults.empty()) {
    throw StorageError(from + " is damaged, and so would be the copy: " + faults.front());
  }
  return source.remark;
}

void back_up(const std::string& from, const std::string& to) {
  if (std::filesystem::exists(to)) {
    throw StorageError(to + " exists already: name a file that does not");
  }
  DraftFile draft(to + ".part");
  copy_into(draft, from, to);
  draft.keep_as(to);
}

}  // namespace oblique::server
