#include "server/store/write_ahead_log.h"

#include <algorithm>
#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

sqlite3_file* file_of(sqlite3* database) {
  sqlite3_file* file = nullptr;
  sqlite3_file_control(database, "main", SQLITE_FCNTL_JOURNAL_POINTER, &file);
  // null if the log is not open
  return file != nullptr && file->pMethods != nullptr ? file : nullptr;
}

/// Rewrites every byte of the file unchanged and syncs it. Returns SQLite's result code.
int write_again(sqlite3_file* file) {
  std::vector<char> bytes(std::size_t{1} << 16U);
  sqlite3_int64 size = 0;
  int code = file->pMethods->xFileSize(file, &size);
  for (sqlite3_int64 at = 0; at < size && code == SQLITE_OK; at += std::ssize(bytes)) {
    const auto part = static_cast<int>(std::min<sqlite3_int64>(std::ssize(bytes), size - at));
    code = file->pMethods->xRead(file, bytes.data(), part, at);
    if (code == SQLITE_OK) {
      code = file->pMethods->xWrite(file, bytes.data(), part, at);
    }
  }
  return code == SQLITE_OK ? file->pMethods->xSync(file, SQLITE_SYNC_NORMAL) : code;
}

}  // namespace

WriteAheadLog::WriteAheadLog(sqlite3* database) : database_(database) {
  sqlite3_busy_timeout(database_, kBusyTimeout_ms);
  sqlite3_db_config(database_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  sqlite3_wal_hook(
      database_,
      [](void* log, sqlite3*, const char*, int pages) {
        static_cast<WriteAheadLog*>(log)->pages_ = pages;
        return SQLITE_OK;
      },
      this);
}

void WriteAheadLog::rewrite() {
  const Transaction transaction(database_);  // locks other writers out
  sqlite3_file* file = file_of(database_);
  const int code = file != nullptr ? write_again(file) : SQLITE_OK;
  if (code != SQLITE_OK) {
    throw StorageError("the write-ahead log could not be rewritten when the server started: " +
                       std::string(sqlite3_errstr(code)));
  }
}

int WriteAheadLog::checkpoint(int mode, int* in_log, int* copied) {
  const int code = sqlite3_wal_checkpoint_v2(database_, "main", mode, in_log, copied);
  check_gone(database_, code);
  return code;
}

void WriteAheadLog::shorten() {
  if (pages_ < long_pages_) {
    return;
  }
  int in_log = 0;
  int copied = 0;
  if (checkpoint(SQLITE_CHECKPOINT_PASSIVE, &in_log, &copied) == SQLITE_OK && in_log == copied) {
    pages_ = 0;  // the next commit overwrites the log from its beginning
  }
}

bool WriteAheadLog::merge() {
  // Does not wait for a slow reader, because results would have to wait too.
  sqlite3_busy_timeout(database_, 0);
  const int code = checkpoint(SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
  sqlite3_busy_timeout(database_, kBusyTimeout_ms);
  if ((static_cast<unsigned>(code) & 0xffU) == SQLITE_BUSY) {
    return false;
  }
  if (code != SQLITE_OK) {
    throw StorageError("the write-ahead log cannot be merged into the database: " +
                       std::string(sqlite3_errstr(code)));
  }
  pages_ = 0;
  return true;
}

}  // namespace oblique::server
