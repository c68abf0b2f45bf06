#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace oblique::test {

/// Waits until `condition` holds. After kHangLimit throws std::runtime_error that contains `what`.
void wait_until(const std::string& what, const std::function<bool()>& condition);

/// Returns true if the process runs, false if it is a zombie.
bool is_running(pid_t pid);

/// Returns the child processes of `pid`.
std::vector<pid_t> children_of(pid_t pid);

/// Returns all processes, of any parent, whose environment contains the path of `folder`.
std::vector<pid_t> processes_of(const TemporaryFolder& folder);

/// Environment variables of a program. They extend or replace the variables of this process.
using Environment = std::map<std::string, std::string>;

/// Result of one run of a program.
struct Outcome {
  int exit_code;    ///< exit code or minus the signal, as Process::wait returns it
  std::string out;  ///< standard output
  std::string err;  ///< standard error
};

/// A program under test. It runs in its own process group and in `folder`. Its input is empty; its
/// output goes to files in the folder.
class Process {
 public:
  /// Starts `program` with `arguments`. Variables of oblique's programs and of systemd are removed
  /// unless `environment` sets them, and installed configuration files are not read. `ready_fd`,
  /// unless −1, becomes the program's descriptor 3. Throws std::runtime_error if the program does
  /// not start.
  Process(const TemporaryFolder& folder, const std::string& program,
          const std::vector<std::string>& arguments, const Environment& environment = {},
          int ready_fd = -1);
  /// Kills the process if it still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  void send(int signal) const;
  /// Returns the result of wait() if the process has ended, else nothing.
  std::optional<int> exit_code();
  /// Waits until the process ends. Returns its exit code, or minus the signal that ended it: a
  /// program that handles SIGINT and exits returns 130; SIGINT without a handler gives −2.
  int wait();
  /// Return standard output and standard error so far.
  std::string out() const;
  std::string err() const;
  /// Waits until the process ends.
  Outcome outcome();

 private:
  bool reap();

  std::string out_file_;
  std::string err_file_;
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

}  // namespace oblique::test
