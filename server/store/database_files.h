#pragma once

#include <string>

#include <sys/stat.h>

namespace oblique::server {

/// The file of a database that is open for writing. A program that holds a file open goes on
/// writing to it after somebody deleted, renamed or replaced it, and all that is lost: `check`
/// notices that.
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

  /// Throws StorageGone unless the file at the path has the device and inode of the opened one. The
  /// contents are not compared.
  void check() const;

 private:
  std::string path_;  // absolute: the folder may be renamed with the process in it
  bool made_ = false;
  int file_ = -1;
  struct stat opened_ {};
};

}  // namespace oblique::server
