#pragma once

#include <string>
#include <string_view>

#include <sys/stat.h>

#include "server/database/sqlite.h"

// Files of databases: how they are opened, locked and completed.
namespace oblique::server {

/// Throws StorageError when `path` exists and is not a regular file.
void check_path(const std::string& path);

/// Opens the database at `path` for reading only; does not check whether it is ours. SQLite may
/// create an index of the write-ahead log beside it. In a folder that cannot be written the
/// database is read without that file, including the rows in the log. Throws StorageError when
/// there is no such file or it cannot be opened.
DatabaseHandle open_for_reading(const std::string& path);

/// As `open_for_reading`; throws StorageError, which says what was found, unless the file is a
/// database of ours with tables.
DatabaseHandle open_stored(const std::string& path);

/// Type of the file system that holds `path`, such as "ext4" or "fuse.sshfs", as the system names
/// it. `path` need not exist.
std::string file_system_of(const std::string& path);

/// Why a database at `path` (which need not exist) is not safe on its file system, or an empty
/// text. A network file system has neither the locks nor the shared memory that SQLite's
/// Whether other machines may write to files of this type of file system, as "nfs4".
bool is_network_file_system(std::string_view type);

/// write-ahead log needs: two machines could write at once and damage the file.
std::string network_disk_error(const std::string& path);

/// Returns `path`. Throws StorageError when it is on a network disk and these are not allowed.
const std::string& path_on_own_disk(const std::string& path, bool allows_network_disk);

/// Whether a server has the database at `path` open; false for a file that cannot be opened. Takes
/// no lock.
bool is_in_use(const std::string& path);

/// The file of a database that a server writes, locked against other servers. What a program writes
/// to a file after the file was deleted, renamed or replaced is lost; `check` detects this.
class ServerFile {
 public:
  /// Opens the file at `path`, or creates it with mode 0600. The object must outlive every
  /// connection, because closing the file drops SQLite's own locks. Throws StorageError.
  explicit ServerFile(const std::string& path);
  ~ServerFile();
  ServerFile(const ServerFile&) = delete;
  ServerFile& operator=(const ServerFile&) = delete;

  /// Whether the file was created.
  bool is_new() const { return is_new_; }

  /// Throws StorageGone unless the file at the path has the device and inode of the opened one. The
  /// contents are not compared.
  void check() const;

 private:
  std::string path_;  // absolute: the folder may be renamed with the process in it
  bool is_new_ = false;
  int file_ = -1;
  struct stat opened_ {};
};

/// A database that is not complete yet, and the files that SQLite puts beside it. The destructor
/// deletes them, so that an incomplete database never has the final name.
class DraftFile {
 public:
  /// Creates an empty file with mode 0600. Throws StorageError.
  explicit DraftFile(std::string path);
  ~DraftFile() { remove(); }
  DraftFile(const DraftFile&) = delete;
  DraftFile& operator=(const DraftFile&) = delete;

  const std::string& path() const { return path_; }

  /// Flushes the file to the disk and gives it its name. Throws StorageError.
  void keep_as(const std::string& name) const;

 private:
  void remove() const;
  std::string path_;
};

}  // namespace oblique::server
