#pragma once

#include <string>

#include <sys/stat.h>

namespace oblique::server {

/// The file of a database that is open for writing. What a program writes to a file after the file
/// was deleted, renamed or replaced is lost; `check` detects this.
class DatabaseFiles {
 public:
  /// Opens the file at `path`, or creates it with mode 0600, and locks it against other servers
  /// until the end of this object. It must outlive every connection, because closing the file drops
  /// SQLite's own locks. Throws StorageError.
  explicit DatabaseFiles(const std::string& path);
  ~DatabaseFiles();
  DatabaseFiles(const DatabaseFiles&) = delete;
  DatabaseFiles& operator=(const DatabaseFiles&) = delete;

  /// Whether the file was created.
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
