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

/// A process could not be started, or it ended unexpectedly.
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

/// A pipe. A child process inherits only an end that ChildSettings names.
struct Pipe {
  Pipe();  ///< Throws ProcessError.
  Descriptor read;
  Descriptor write;
};

struct ChildSettings {
  std::filesystem::path program;       ///< a name without a slash is searched for in PATH
  std::vector<std::string> arguments;  ///< arguments after the program's name
  bool show_errors = false;            ///< standard error goes to ours; otherwise its text is kept
  int handed_over = -1;                ///< descriptor that becomes the child's kHandedOver
  bool keep_output = false;            ///< keeps standard output separately from standard error
  std::string hidden_variables{};      ///< prefix of environment variables to hide; empty: none
  std::optional<std::string> input{};  ///< text for standard input; without it the input is empty
  bool stays_in_our_group = false;     ///< the child receives our group's signals
  int input_from = -1;                 ///< descriptor that becomes the child's standard input
  bool show_output = false;            ///< the child writes to our standard output
};

/// A child process, killed and reaped by the destructor. By default it has its own process group:
/// Ctrl-C on the terminal then reaches only our process, which stops the child.
class ChildProcess {
 public:
  /// Number that the descriptor `ChildSettings::handed_over` has in the child.
  static constexpr int kHandedOver = 3;

  /// Throws ProcessError, which names the program, if the program cannot be started.
  explicit ChildProcess(const ChildSettings& settings);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Whether the process still runs. Reaps it if it has ended.
  bool is_running() { return !has_ended(false); }
  void wait() { has_ended(true); }
  /// Sends a signal unless the process has ended.
  void send(int signal);
  pid_t pid() const { return pid_; }

  /// Whether the process ended with exit code 0.
  bool succeeded() const;
  /// Describes the end: "ended with exit code 1" or "was killed by signal 9 (Killed)".
  std::string ending() const;
  /// Returns the last lines of the child's standard error, if kept.
  std::string last_output() const;
  /// Returns the child's standard output, if kept. Throws ProcessError if it exceeds `most_bytes`.
  std::string output(std::size_t most_bytes) const;

 private:
  bool has_ended(bool waits);

  pid_t pid_ = -1;
  std::optional<int> status_;  ///< status from waitpid; nothing while the child runs
  Descriptor errors_;          ///< in-memory file with the child's standard error
  Descriptor output_;          ///< in-memory file with the child's standard output
};

/// Runs a program to its end and returns its standard output, at most 16 MiB. Throws ProcessError,
/// with the last lines of standard error, if the program cannot be started or fails. Calls
/// `keep_waiting` many times a second; if it returns false, kills the program and throws
/// ProcessError.
std::string output_of(ChildSettings settings, const std::function<bool()>& keep_waiting = {});

/// Returns the path of the program `name` in the folder that contains our own program. Throws
/// ProcessError if it does not exist.
std::filesystem::path sibling_program(const std::string& name);

}  // namespace oblique::client
