#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace oblique::test {

/// Waits until `condition` holds. Throws std::runtime_error that names `what` after kHangLimit.
void wait_until(const std::string& what, const std::function<bool()>& condition);

/// Whether the process runs; false for a zombie.
bool is_running(pid_t pid);

/// Child processes of `pid`.
std::vector<pid_t> children_of(pid_t pid);

/// Processes whose environment contains the path of this folder, whatever their parent.
std::vector<pid_t> processes_of(const TemporaryFolder& folder);

/// Variables for a program, added to those of this process or in place of them.
using Environment = std::map<std::string, std::string>;

/// Result of one run of a program.
struct Outcome {
  int exit_code;    ///< as of Process::wait
  std::string out;  ///< standard output
  std::string err;  ///< standard error
};

/// A program under test, in its own process group, with `folder` as its current folder. Its input
/// is empty; its output goes to files in the folder.
class Process {
 public:
  /// Starts `program` with `arguments`. Variables of our programs and of systemd are removed unless
  /// `environment` sets them, and configuration files of this machine are not read. `ready_fd`,
  /// unless −1, becomes its descriptor 3. Throws std::runtime_error if it does not start.
  Process(const TemporaryFolder& folder, const std::string& program,
          const std::vector<std::string>& arguments, const Environment& environment = {},
          int ready_fd = -1);
  /// Kills the process if it still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  void send(int signal) const;
  /// As wait(); nothing while it runs.
  std::optional<int> exit_code();
  /// Waits for the end. Returns the exit code, or minus the signal that ended it: a program that
  /// handles SIGINT and exits returns 130, one that SIGINT kills returns −2.
  int wait();
  /// Standard output and standard error so far.
  std::string out() const;
  std::string err() const;
  /// Waits for the end.
  Outcome outcome();

 private:
  bool reap();

  std::string out_file_;
  std::string err_file_;
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

}  // namespace oblique::test
