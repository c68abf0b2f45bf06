#pragma once

#include <filesystem>
#include <string>

namespace oblique::test {

/// A temporary folder, deleted with its contents by the destructor.
class TemporaryFolder {
 public:
  /// Creates it below TMPDIR. Throws std::runtime_error if this fails.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Path of a file in the folder; the file need not exist.
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace oblique::test
