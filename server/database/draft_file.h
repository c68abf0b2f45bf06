#pragma once

#include <string>

namespace oblique::server {

/// The path of a database in the making, with all that SQLite puts beside it. What is there goes
/// with this object, so that a half-made database never has its name.
class DraftFile {
 public:
  /// Makes the file, empty and for its owner alone (mode 0600). Throws StorageError.
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
