#pragma once

#include <string>

namespace oblique::server {

/// A database that is not complete yet, and the files that SQLite puts beside it. The destructor
/// deletes them, so that an incomplete database never has the final name.
class DraftFile {
 public:
  /// Creates an empty file with mode 0600. Throws StorageError.
  explicit DraftFile(std::string path);
  ~DraftFile();
  DraftFile(const DraftFile&) = delete;
  DraftFile& operator=(const DraftFile&) = delete;

  const std::string& path() const { return path_; }

  /// Flushes the file to the disk and gives it its name. Throws StorageError.
  void keep_as(const std::string& name);

 private:
  void remove() const;
  std::string path_;
};

}  // namespace oblique::server
