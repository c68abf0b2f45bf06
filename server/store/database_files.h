#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <sys/types.h>

#include "server/database/sqlite.h"

namespace oblique::server {

/// The files of a database that is open for writing, found again by their names. A program that
/// holds a file open goes on writing to it when somebody deletes or renames it, or puts another one
/// in its place, and all that it writes then is lost: so it must look.
class DatabaseFiles {
 public:
  /// Opens the file at `path`, or makes it for its owner alone (mode 0600), and holds it against
  /// other servers until the end of this object, which must outlive every connection: closing the
  /// file drops SQLite's own locks. Throws StorageError when that cannot be done.
  explicit DatabaseFiles(const std::string& path);
  ~DatabaseFiles();
  DatabaseFiles(const DatabaseFiles&) = delete;
  DatabaseFiles& operator=(const DatabaseFiles&) = delete;

  /// There was no file at the path.
  bool were_made() const { return made_; }

  /// Whatever files belong to the database by now must stay. `database` must outlive this.
  void expect(sqlite3* database, const std::string& database_id);

  /// The last `check` found the file where it was, with the contents of something else.
  bool were_overwritten() const { return overwritten_; }

  /// Throws StorageGone, naming what is gone, unless the files that are expected are at their
  /// paths and the database is the one with that identity. Costs some microseconds.
  void check();

 private:
  struct Identity {
    dev_t device;
    ino_t inode;
    bool operator==(const Identity&) const = default;
  };
  static std::optional<Identity> identity_of(const std::string& path);
  void check_file(const std::string& name, const Identity& expected) const;
  void check_contents();
  std::int64_t page_of_identity() const;
  std::optional<bool> page_has_identity() const;

  std::string path_;  // absolute: the folder may be renamed with the process in it
  int file_ = -1;
  bool made_ = false;
  sqlite3* database_ = nullptr;
  std::string database_id_;
  std::array<std::optional<Identity>, 3> expected_;  // the database, its log, its index of the log
  std::int64_t page_ = 0;                            // of the table `about`
  std::int64_t page_size_ = 0;
  bool overwritten_ = false;
  bool seen_ = false;  // the page was in the file, not only in the log
};

}  // namespace oblique::server
