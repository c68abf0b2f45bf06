#pragma once

#include <string>
#include <string_view>

#include <sys/stat.h>

#include "proto/system/descriptor.h"
#include "server/database/sqlite.h"

// Functions that open, lock and complete database files.
namespace oblique::server {

/// Throws StorageError when `path` exists and is not a regular file.
void check_path(const std::string& path);

/// Opens the database at `path` for reading only, without checking that it is one of ours. SQLite
/// may create an index of the write-ahead log beside the database. In a read-only folder SQLite
/// reads the log without an index file. Throws StorageError if the file does not exist or cannot be
/// opened.
DatabaseHandle open_for_reading(const std::string& path);

/// Works like `open_for_reading`, but also checks that the file is a database of ours with tables.
/// If it is not, throws StorageError, which describes the file.
DatabaseHandle open_stored(const std::string& path);

/// Returns the type of the file system that holds `path`, as the system reports it, such as "ext4"
/// or "fuse.sshfs". `path` need not exist.
std::string file_system_of(const std::string& path);

/// Returns whether other machines may write to files on this type of file system, such as "nfs4".
bool is_network_file_system(std::string_view type);

/// Returns why a database at `path` is not safe on its file system, or an empty text. A network
/// file system lacks the locks and shared memory that SQLite's write-ahead log needs, so two
/// machines could write at once and damage the file. `path` need not exist.
std::string network_disk_error(const std::string& path);

/// Returns `path`. Throws StorageError for a network disk, unless `allows_network_disk`.
const std::string& path_on_own_disk(const std::string& path, bool allows_network_disk);

/// Returns whether a server has the database open; false if the file cannot be opened. Takes no
/// lock.
bool is_in_use(const std::string& path);

/// The database file of a server, locked against other servers. If the file is deleted, renamed or
/// replaced, data written later is lost; `check` detects this.
class ServerFile {
 public:
  /// Opens the file at `path`, or creates it with mode 0600. This object must outlive every
  /// connection, because closing the file releases SQLite's locks. Throws StorageError.
  explicit ServerFile(const std::string& path);
  ServerFile(const ServerFile&) = delete;
  ServerFile& operator=(const ServerFile&) = delete;

  /// Returns whether this object has created the file.
  bool is_new() const { return is_new_; }

  /// Throws StorageGone unless the file at the path has the same device and inode as the opened
  /// file. The contents are not compared.
  void check() const;

 private:
  std::string path_;  // absolute, because the current folder may be renamed
  bool is_new_ = false;
  protocol::Descriptor file_;
  struct stat opened_ {};
};

/// A database that is not complete yet, with SQLite's files beside it. The destructor deletes these
/// files, so an incomplete database never has the final name.
class DraftFile {
 public:
  /// Creates an empty file with mode 0600. Throws StorageError.
  explicit DraftFile(std::string path);
  ~DraftFile() { remove(); }
  DraftFile(const DraftFile&) = delete;
  DraftFile& operator=(const DraftFile&) = delete;

  const std::string& path() const { return path_; }

  /// Syncs the file, renames it to `name` and syncs the folder. Throws StorageError.
  void keep_as(const std::string& name) const;

 private:
  void remove() const;
  std::string path_;
};

}  // namespace oblique::server
