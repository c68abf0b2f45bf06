#include "server/database/open_for_reading.h"

#include <array>
#include <filesystem>
#include <string_view>
#include <system_error>

#include <unistd.h>

namespace oblique::server {
namespace {

constexpr int kBusyTimeout_ms = 5000;

/// SQLite's result code for a first read.
int look_at(sqlite3* database) {
  return sqlite3_exec(database, "PRAGMA schema_version", nullptr, nullptr, nullptr);
}

/// Whether SQLite could not create or open a file beside the database.
bool lacks_files(int code) {
  const unsigned kind = static_cast<unsigned>(code) & 0xffU;
  return kind == SQLITE_CANTOPEN || kind == SQLITE_READONLY;
}

bool can_write_beside(const std::string& path) {
  const auto folder = std::filesystem::absolute(path).parent_path();
  return ::access(folder.c_str(), W_OK) == 0;
}

std::string as_uri(const std::string& path) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~/";
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string uri = "file:";
  for (const char letter : std::filesystem::absolute(path).string()) {
    if (kPlain.find(letter) != std::string_view::npos) {
      uri += letter;
    } else {
      const auto byte = static_cast<unsigned char>(letter);
      uri += {'%', kDigits[byte >> 4U], kDigits[byte & 0xfU]};
    }
  }
  return uri;
}

/// Opens a database without files beside it; the index of the log is in memory.
DatabaseHandle open_alone(const std::string& path) {
  std::error_code no_log;
  const bool has_log = std::filesystem::file_size(path + "-wal", no_log) > 0 && !no_log;
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
  check_path(path);
  if (!std::filesystem::exists(path)) {
    throw StorageError("there is no database " + path);
  }
  OpenedForReading opened{open_database(path, SQLITE_OPEN_READONLY), {}};
  sqlite3_busy_timeout(opened.database.get(), kBusyTimeout_ms);
  if (lacks_files(look_at(opened.database.get())) && !can_write_beside(path)) {
    opened.database = open_alone(path);
    opened.remark = path +
                    " lies where nothing can be written: it is read as it stands, without "
                    "regard to a server that may write to it from another machine or user";
  }
  return opened;
}

DatabaseHandle open_without_traces(const std::string& path) {
  check_path(path);
  if (!std::filesystem::exists(path)) {
    throw StorageError("there is no database " + path);
  }
  const auto has_bytes = [&path](const char* ending) {
    std::error_code none;
    return std::filesystem::file_size(path + ending, none) > 0 && !none;
  };
  if (has_bytes("-wal") && has_bytes("-shm")) {
    DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
    if (!lacks_files(look_at(database.get()))) {
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
