#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace oblique::test {

/// Waits until `condition` is true. Throws std::runtime_error with `what` after a time that is too
/// long for any correct run.
void wait_until(const std::string& what, const std::function<bool()>& condition);

/// Whether the process runs. A process that has ended and was not waited for does not.
bool is_running(pid_t pid);

/// Processes that `pid` started and that still have it as their parent.
std::vector<pid_t> children_of(pid_t pid);

/// Processes whose environment contains the path of this folder, whatever their parent is.
std::vector<pid_t> processes_of(const TemporaryFolder& folder);

/// Variables for a program, beside our own or in place of them.
using Environment = std::map<std::string, std::string>;

/// Exit code and output of a run of a program.
struct Outcome {
  int exit_code;    ///< as of Process::wait
  std::string out;  ///< standard output
  std::string err;  ///< standard error
};

/// A program under test, with its own process group and with the folder as its current folder. Its
/// input is empty; its output goes to files in the folder.
class Process {
 public:
  /// Starts `program` with `arguments`. It does not inherit environment variables of our programs
  /// or of systemd, and does not read the configuration files of this machine. `environment` is
  /// added. `ready_fd`, unless −1, becomes its file descriptor 3. Throws std::runtime_error if the
  /// program does not start.
  Process(const TemporaryFolder& folder, const std::string& program,
          const std::vector<std::string>& arguments, const Environment& environment = {},
          int ready_fd = -1);
  /// Kills what still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  void send(int signal) const;
  /// The exit code as from wait(); nothing while it runs.
  std::optional<int> exit_code();
  /// Waits for the end. Returns the exit code, or minus the signal that killed the process: 130 if
  /// the program handled SIGINT and ended, −2 if SIGINT killed it.
  int wait();
  /// What it has written so far to standard output and standard error.
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
