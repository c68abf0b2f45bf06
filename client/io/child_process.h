#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "proto/system/descriptor.h"

namespace oblique::client {

/// A process could not be started or ended unexpectedly.
class ProcessError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The program does not exist.
class ProgramNotFound : public ProcessError {
 public:
  using ProcessError::ProcessError;
};

using protocol::Descriptor;

/// A pipe. Children inherit an end only if it is handed to them.
struct Pipe {
  Pipe();  ///< Throws ProcessError.
  Descriptor read;
  Descriptor write;
};

struct ChildSettings {
  std::filesystem::path program;       ///< a name without a slash is searched in PATH
  std::vector<std::string> arguments;  ///< without the program's name
  bool show_errors = false;            ///< true: standard error goes to ours; false: it is kept
  int handed_over = -1;                ///< descriptor that becomes the child's kHandedOver
  bool keep_output = false;            ///< keeps standard output separately; else with standard
                                       ///< error
  std::string hidden_variables{};      ///< hides variables with this prefix; empty: none
  std::optional<std::string> input{};  ///< text for standard input; none: empty input
  bool stays_in_our_group = false;     ///< stays in our process group and receives its signals
  int input_from = -1;                 ///< descriptor that becomes its standard input
  bool show_output = false;            ///< standard output goes to ours
};

/// A child process, killed and reaped by the destructor. By default it has its own process group,
/// so that Ctrl-C on the terminal reaches only us and we end the child in order.
class ChildProcess {
 public:
  /// Number of the handed-over descriptor in the child.
  static constexpr int kHandedOver = 3;

  /// Throws ProcessError with the program's name.
  explicit ChildProcess(const ChildSettings& settings);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Whether it still runs. Reaps it if it has ended.
  bool is_running() { return !has_ended(false); }
  void wait() { has_ended(true); }
  /// Sends a signal unless it has ended.
  void send(int signal);
  pid_t pid() const { return pid_; }

  /// Whether it ended with exit code 0.
  bool succeeded() const;
  /// How it ended: "ended with exit code 1" or "was killed by signal 9 (Killed)".
  std::string ending() const;
  /// The last lines of its standard error, if kept.
  std::string last_output() const;
  /// Its standard output, if kept. Throws ProcessError if it is longer than `most_bytes`.
  std::string output(std::size_t most_bytes) const;

 private:
  bool has_ended(bool waits);

  pid_t pid_ = -1;
  std::optional<int> status_;  ///< status of waitpid; none while it runs
  Descriptor errors_;          ///< memory file with its standard error
  Descriptor output_;          ///< memory file with its standard output
};

/// Runs a program to its end and returns its standard output, at most 16 MiB. Throws ProcessError,
/// with the last lines of standard error, if the program cannot be started or fails. `keep_waiting`
/// is called many times a second; when it returns false the program is killed and ProcessError
/// thrown.
std::string output_of(ChildSettings settings, const std::function<bool()>& keep_waiting = {});

/// The program `name` in the folder of our own. Throws ProcessError if it does not exist.
std::filesystem::path sibling_program(const std::string& name);

}  // namespace oblique::client
