#include "server/database/open_for_reading.h"

#include <filesystem>
#include <system_error>

#include <unistd.h>

#include "server/database/database_file.h"

namespace oblique::server {
namespace {

constexpr int kBusyTimeout_ms = 5000;

/// SQLite's result code for a first read.
int first_read(sqlite3* database) {
  return sqlite3_exec(database, "PRAGMA schema_version", nullptr, nullptr, nullptr);
}

/// Whether SQLite could not create or open a file beside the database.
bool lacks_files(int code) {
  const unsigned kind = static_cast<unsigned>(code) & 0xffU;
  return kind == SQLITE_CANTOPEN || kind == SQLITE_READONLY;
}

/// The path as a URI of SQLite, in which only these letters have a meaning.
std::string as_uri(const std::string& path) {
  std::string uri = "file:";
  for (const char letter : std::filesystem::absolute(path).string()) {
    uri += letter == '%'   ? "%25"
           : letter == '?' ? "%3f"
           : letter == '#' ? "%23"
                           : std::string(1, letter);
  }
  return uri;
}

bool has_bytes(const std::string& file) {
  std::error_code none;
  return std::filesystem::file_size(file, none) > 0 && !none;
}

void check_exists(const std::string& path) {
  check_path(path);
  if (!std::filesystem::exists(path)) {
    throw StorageError("there is no database " + path);
  }
}

/// Opens a database without files beside it; the index of the log is in memory.
DatabaseHandle open_alone(const std::string& path) {
  const bool has_log = has_bytes(path + "-wal");
  // SQLite ignores the log of an immutable database. With a log, the database is opened without
  // locks and in exclusive mode, in which SQLite keeps the index of the log in memory.
  DatabaseHandle database =
      open_database(as_uri(path) + (has_log ? "?vfs=unix-none" : "?immutable=1"),
                    SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
  if (has_log) {
    execute(database.get(), "PRAGMA locking_mode = EXCLUSIVE");
    sqlite3_db_config(database.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  }
  return database;
}

}  // namespace

OpenedForReading open_for_reading(const std::string& path) {
  check_exists(path);
  OpenedForReading opened{open_database(path, SQLITE_OPEN_READONLY), {}};
  sqlite3_busy_timeout(opened.database.get(), kBusyTimeout_ms);
  const auto folder = std::filesystem::absolute(path).parent_path();
  if (lacks_files(first_read(opened.database.get())) && ::access(folder.c_str(), W_OK) != 0) {
    opened.database = open_alone(path);
    opened.remark = path +
                    " is in a folder without write access: it is read as it is, and changes that "
                    "another machine or user makes meanwhile are not seen";
  }
  return opened;
}

DatabaseHandle open_without_traces(const std::string& path) {
  check_exists(path);
  if (has_bytes(path + "-wal") && has_bytes(path + "-shm")) {
    DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
    if (!lacks_files(first_read(database.get()))) {
      return database;
    }
  }
  return open_alone(path);
}

OpenedForReading open_stored(const std::string& path) {
  OpenedForReading opened = open_for_reading(path);
  if (identify(opened.database.get(), path) == DatabaseKind::kEmpty) {
    throw StorageError(path + " is empty: no study was ever stored in it");
  }
  return opened;
}

}  // namespace oblique::server
