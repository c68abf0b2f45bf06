#pragma once

#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace oblique::client {

/// What one run of the program gave.
struct Outcome {
  int exit_code;    ///< -1 when a signal ended it
  std::string out;  ///< standard output
  std::string err;  ///< standard error
};

/// A folder for one test, removed with it; the program runs in it.
class TestFolder {
 public:
  TestFolder();
  ~TestFolder();
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// `oblique` started in `folder` without OBLIQUE_SERVER in its environment.
class Program {
 public:
  Program(const TestFolder& folder, const std::vector<std::string>& arguments);
  /// Kills it if it still runs.
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  pid_t pid() const { return pid_; }
  /// Process numbers of its children now.
  std::vector<pid_t> children() const;
  /// What it has written to standard error so far.
  std::string err() const;
  /// Waits for its end.
  Outcome outcome();

 private:
  std::filesystem::path out_;
  std::filesystem::path err_;
  pid_t pid_;
  bool ended_ = false;
};

/// Runs `oblique` to its end in a folder of its own.
Outcome oblique(const std::vector<std::string>& arguments);
Outcome oblique(const TestFolder& folder, const std::vector<std::string>& arguments);

}  // namespace oblique::client
