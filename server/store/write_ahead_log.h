#pragma once

#include <sqlite3.h>

namespace oblique::server {

/// Makes the checkpoints of an open database, because SQLite ignores failures of its own ones.
///
/// After a failed sync Linux takes what it could not write for written, and a later sync succeeds
/// without it. A checkpoint of such a log could leave the database with parts of a transaction when
/// the power is lost. So each failed sync throws StorageGone, which ends the server, and the next
/// one writes the log anew before it builds on it.
class WriteAheadLog {
 public:
  /// Takes over the checkpoints of `database`, which must outlive this.
  explicit WriteAheadLog(sqlite3* database);
  WriteAheadLog(const WriteAheadLog&) = delete;
  WriteAheadLog& operator=(const WriteAheadLog&) = delete;

  /// Writes the bytes of the log as they are and syncs them. To be called once, before the first
  /// change: it is unknown how the server before ended. Throws StorageError.
  void rewrite();
  /// Copies a long log into the database. Committed transactions stay when this fails. Throws
  /// StorageGone after a failed sync; other failures are ignored, and it is tried again.
  void shorten();
  /// Copies all of it into the database and empties it. False when a reader still needs it. Throws
  /// StorageError.
  bool merge();
  /// Whether readers keep the log from being shortened for so long that changes that can wait
  /// should wait.
  bool is_held_long() const { return pages_ > kHeldLong * long_pages_; }
  /// Length in pages from which on `shorten` copies the log.
  void shorten_at(int pages) { long_pages_ = pages; }
  /// Lets SQLite copy and delete the log when the database is closed. Not after a failed sync.
  void delete_on_close() {
    sqlite3_db_config(database_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, nullptr);
  }

 private:
  int checkpoint(int mode, int* in_log, int* copied);

  sqlite3* database_;
  int pages_ = 0;
  int long_pages_ = 1000;
  static constexpr int kHeldLong = 16;
  static constexpr int kBusyTimeout_ms = 2000;  // of other statements than `merge`
};

}  // namespace oblique::server
