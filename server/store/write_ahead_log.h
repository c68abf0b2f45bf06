#pragma once

#include <sqlite3.h>

namespace oblique::server {

/// Makes the checkpoints of an open database, because SQLite ignores a failed automatic one.
///
/// After a failed sync Linux marks the unwritten pages as clean, and a later sync succeeds without
/// having stored them. If the power fails during a checkpoint of such a log, the database may have
/// only part of a transaction. So each failed sync throws StorageGone, which ends the server, and
/// the next server writes the whole log again before any change.
class WriteAheadLog {
 public:
  /// Takes over the checkpoints of `database`, which must outlive this.
  explicit WriteAheadLog(sqlite3* database);
  WriteAheadLog(const WriteAheadLog&) = delete;
  WriteAheadLog& operator=(const WriteAheadLog&) = delete;

  /// Writes the bytes of the log again, unchanged, and syncs them. To be called once, before the
  /// first change: the previous server may have ended after a failed sync. Throws StorageError.
  void rewrite();
  /// Copies a long log into the database. Committed transactions stay when this fails. Throws
  /// StorageGone after a failed sync; after other failures the next call tries again.
  void shorten();
  /// Copies the whole log into the database and empties it. False when a reader still needs it.
  /// Throws StorageError.
  bool merge();
  /// Whether the log is so long, because readers prevent a checkpoint, that changes that can wait
  /// should wait.
  bool is_held_long() const { return pages_ > kHeldLong * long_pages_; }
  /// Sets the length [pages] from which on `shorten` copies the log.
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
  static constexpr int kBusyTimeout_ms = 2000;  // `merge` does not wait
};

}  // namespace oblique::server
