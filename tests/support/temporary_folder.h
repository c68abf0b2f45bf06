#pragma once

#include <filesystem>
#include <string>

namespace oblique::test {

/// A folder for one test, deleted with its contents by the destructor.
class TemporaryFolder {
 public:
  /// Creates the folder in TMPDIR. Throws std::runtime_error on failure.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// The path of a file in the folder, whether or not it exists.
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace oblique::test
