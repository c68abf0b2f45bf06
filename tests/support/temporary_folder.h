#pragma once

#include <filesystem>
#include <string>

namespace oblique::test {

/// A temporary folder. The destructor deletes it with its contents.
class TemporaryFolder {
 public:
  /// Creates the folder in TMPDIR. Throws std::runtime_error if this fails.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Returns the path of a file in the folder; the file need not exist.
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace oblique::test
