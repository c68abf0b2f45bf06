#pragma once

#include <sqlite3.h>

namespace oblique::server {

/// Makes the checkpoints of an open database, because SQLite ignores failures of its automatic
/// checkpoints.
///
/// After a failed sync Linux marks the unwritten pages as clean, and a later sync succeeds without
/// having stored them. If such a log is copied into the database and the power fails, the database
/// may contain part of a transaction. So each failed sync throws StorageGone, which ends the
/// server, and the next server rewrites the whole log before any change.
class WriteAheadLog {
 public:
  /// Disables the automatic checkpoints of `database`, which must outlive this object.
  explicit WriteAheadLog(sqlite3* database);
  WriteAheadLog(const WriteAheadLog&) = delete;
  WriteAheadLog& operator=(const WriteAheadLog&) = delete;

  /// Rewrites the log unchanged and syncs it. Must be called once, before the first change, because
  /// the previous server may have ended after a failed sync. Throws StorageError.
  void rewrite();
  /// Copies the log into the database if the log is long. A failure undoes no commit. Throws
  /// StorageGone after a failed sync; after other failures the next call tries again.
  void shorten();
  /// Copies the whole log into the database and empties it. Returns false if a reader still needs
  /// the log. Throws StorageError.
  bool merge();
  /// Returns whether readers keep the log so large that less urgent changes should wait.
  bool is_held_long() const { return pages_ > kHeldLong * long_pages_; }
  /// Sets the length [pages] above which `shorten` copies the log.
  void shorten_at(int pages) { long_pages_ = pages; }
  /// Makes SQLite copy and delete the log on closing. Must not be called after a failed sync.
  void delete_on_close() {
    sqlite3_db_config(database_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, nullptr);
  }

 private:
  int checkpoint(int mode, int* in_log, int* copied);

  sqlite3* database_;
  int pages_ = 0;
  int long_pages_ = 1000;
  static constexpr int kHeldLong = 16;
  static constexpr int kBusyTimeout_ms = 2000;  // maximum time to wait for locks, except in `merge`
};

}  // namespace oblique::server
