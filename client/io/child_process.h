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

/// A process could not be started, or ended when it was needed.
class ProcessError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// There is no such program.
class ProgramNotFound : public ProcessError {
 public:
  using ProcessError::ProcessError;
};

using protocol::Descriptor;

/// Both ends of a pipe, closed in children unless handed to them.
struct Pipe {
  Pipe();  ///< Throws ProcessError.
  Descriptor read;
  Descriptor write;
};

/// How a child is started.
struct ChildSettings {
  std::filesystem::path program;       ///< without a slash: the first of that name in PATH
  std::vector<std::string> arguments;  ///< without the program's name
  bool show_errors = false;            ///< its standard error goes to ours; else it is kept
  int handed_over = -1;                ///< descriptor that becomes the child's kHandedOver
  bool keep_output = false;            ///< its standard output is kept apart; else with the errors
  std::string hidden_variables{};      ///< hides variables with this prefix; empty: hides none
  std::optional<std::string> input{};  ///< what it reads on standard input; none: nothing
  bool stays_in_our_group = false;     ///< a signal to our process group reaches it
  int input_from = -1;                 ///< descriptor that becomes its standard input
  bool show_output = false;            ///< its standard output goes to ours
};

/// A child process. It has a process group of its own unless set otherwise, so Ctrl-C on the
/// terminal reaches only us and we end it in order. Killed and reaped by the destructor.
class ChildProcess {
 public:
  /// Number of the descriptor that the child is handed.
  static constexpr int kHandedOver = 3;

  /// Throws ProcessError naming the program.
  explicit ChildProcess(const ChildSettings& settings);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Whether it still runs; reaps it when it has ended.
  bool is_running() { return !has_ended(false); }
  /// Waits for its end.
  void wait() { has_ended(true); }
  /// Sends a signal while it runs.
  void send(int signal);
  pid_t pid() const { return pid_; }

  /// Whether it ended with exit code 0.
  bool succeeded() const;
  /// How it ended, as "ended with exit code 1" or "was killed by signal 9 (Killed)".
  std::string ending() const;
  /// The last lines of its standard error, if they were kept.
  std::string last_words() const;
  /// Its standard output, if that was kept. Throws ProcessError for more than `most_bytes`.
  std::string output(std::size_t most_bytes) const;

 private:
  bool has_ended(bool waits);

  pid_t pid_ = -1;
  std::optional<int> status_;  ///< of waitpid; none while it runs
  Descriptor errors_;          ///< memory file with its standard error
  Descriptor output_;          ///< memory file with its standard output
};

/// Runs a program to its end and returns its standard output, at most 16 MiB. Throws ProcessError,
/// with the end of its standard error, when it cannot be started or fails, and when `keep_waiting`,
/// which is called many times a second, returns false: then the program is killed.
std::string output_of(ChildSettings settings, const std::function<bool()>& keep_waiting = {});

/// The program called `name` beside our own. Throws ProcessError when it is not there.
std::filesystem::path sibling_program(const std::string& name);

}  // namespace oblique::client
