#pragma once

#include <sqlite3.h>

namespace oblique::server {

/// Keeps the write-ahead log of an open database honest and short.
///
/// When a sync fails, Linux takes for written what it could not write, and a later sync succeeds
/// without it: commits that stand in the log would be lost with the power, and a checkpoint could
/// leave the database with parts of them. So after a failure all of the log is written again, byte
/// by byte as it is, before anything builds on it. A server that starts does so too, for it does
/// not know how the one before ended. SQLite makes checkpoints by itself, and keeps their failures
/// to itself; so they are made here.
class WriteAheadLog {
 public:
  /// Takes over the checkpoints of `database`, which must outlive this.
  explicit WriteAheadLog(sqlite3* database);
  WriteAheadLog(const WriteAheadLog&) = delete;
  WriteAheadLog& operator=(const WriteAheadLog&) = delete;

  /// Something failed, perhaps a sync.
  void suspect() { is_suspect_ = true; }
  /// Writes the log again if there is reason to. Throws StorageError when that fails.
  void make_sure();
  /// Moves a long log into the database. What was committed stands, also when this fails.
  void shorten();
  /// It stays many times as long as it should be, for readers that need it.
  bool is_held_long() const { return pages_ > kHeldLong * long_pages_; }
  /// Moves all of it into the database and empties it. False when a reader still needs it. Throws
  /// StorageError.
  bool merge();
  /// A log of so many pages is long.
  void shorten_at(int pages) { long_pages_ = pages; }
  /// To be called before the database is closed, which would build on the log.
  void before_closing();

 private:
  sqlite3* database_;
  bool is_suspect_ = true;
  int pages_ = 0;
  int long_pages_ = 1000;
  static constexpr int kHeldLong = 16;
};

}  // namespace oblique::server
