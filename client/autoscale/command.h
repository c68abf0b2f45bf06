#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace oblique::client {

/// A program to run to its end.
struct CommandSettings {
  std::string program;  ///< without a slash: as found in PATH
  std::vector<std::string> arguments;
  bool tells_last_line = false;    ///< of standard error, when it fails, and not all
  double timeout_s = 30.0;         ///< then it is killed
  std::string hidden_variables{};  ///< see ChildSettings
  /// Asked many times a second; false has it killed.
  std::function<bool()> keep_waiting{};
};

/// A program could not be run. The message is a sentence part for people.
class CommandError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The program is nowhere in PATH.
class CommandNotFound : public CommandError {
 public:
  using CommandError::CommandError;
};

/// Runs the program and gives what it wrote to standard output, at most 16 MiB. Throws CommandError
/// naming the program when it cannot be started (CommandNotFound when it is not there), fails, or
/// takes too long, with what it wrote to standard error; Interrupted when the waiting was ended.
std::string output_of(const CommandSettings& command);

}  // namespace oblique::client
