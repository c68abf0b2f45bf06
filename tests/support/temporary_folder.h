#pragma once

#include <filesystem>
#include <string>

namespace oblique::test {

/// A folder of its own for one test; it is gone afterwards, with all that is in it.
class TemporaryFolder {
 public:
  /// Below TMPDIR. Throws std::runtime_error where none can be made.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// The path of a file in it, whether or not it exists.
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace oblique::test
