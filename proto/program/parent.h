#pragma once

#include <sys/types.h>

#include <CLI/CLI.hpp>

namespace oblique::protocol {

/// The option --stop-with-parent [PID] of programs that others start: when the process that started
/// this one ends, this one gets SIGTERM, even if the parent had no time to say anything.
class StopWithParent {
 public:
  /// To be made as the program begins: who is the parent now counts.
  StopWithParent();

  /// Adds the option and gives it back. This must live as long as `app`.
  const CLI::Option* add_to(CLI::App& app);

  /// After the command line is parsed: whether the option was given.
  bool is_wanted() const;

  /// After the command line is parsed and signals are watched: asks the system for the signal, if
  /// the option was given. False when the parent has ended already, which one that gave its own
  /// process id learns whenever it was. Throws std::system_error when the system refuses.
  bool begin() const;

 private:
  CLI::Option* option_ = nullptr;
  pid_t parent_;
  pid_t named_ = 0;  ///< 0: none
};

}  // namespace oblique::protocol
