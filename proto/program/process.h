#pragma once

#include <sys/types.h>

#include <chrono>
#include <csignal>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "proto/system/descriptor.h"

// Signals, the parent process and the service manager, for programs that run long.
namespace oblique::protocol {

/// While it exists, SIGINT, SIGTERM and SIGHUP make a descriptor readable instead of ending the
/// program. A SIGHUP that was ignored at the start, as by nohup, stays ignored. Construct it before
/// any thread starts: threads inherit the mask of signals.
class StopSignals {
 public:
  /// Throws std::system_error when signals cannot be watched.
  StopSignals();
  /// Consumes pending signals, which would end the program once they are unblocked.
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Readable while a signal is pending.
  int descriptor() const { return descriptor_.number(); }

  /// Whether a signal has arrived so far; consumes pending ones. `wait` waits at most `longest`.
  bool requested();
  bool wait(std::chrono::nanoseconds longest);

  /// 128 plus the number of the first signal, as in shells: 130 for Ctrl-C.
  int exit_code() const { return 128 + signal_; }

 private:
  sigset_t before_{};
  Descriptor descriptor_;
  int signal_ = 0;  ///< the first; 0: none
};

/// Makes writes to a pipe without a reader, and to a file at its size limit, fail with an error
/// instead of ending the program.
void survive_failed_writes();

/// The option --stop-with-parent [PID]: this process gets SIGTERM when its parent ends.
class StopWithParent {
 public:
  /// Construct it as the program begins: it stores the present parent.
  StopWithParent();

  /// Adds the option. This must live as long as `app`.
  void add_to(CLI::App& app);
  bool is_wanted() const;

  /// Requests the signal if the option was given. Call it when signals are watched. False when the
  /// parent has ended already; with PID, also when it ended before this process began. Throws
  /// std::system_error when the system refuses.
  bool begin() const;

 private:
  CLI::Option* option_ = nullptr;
  pid_t parent_;
  pid_t named_ = 0;  ///< 0: none
};

/// Sends the state of the program to the service manager (systemd), as datagrams to the socket
/// NOTIFY_SOCKET, which may be an abstract one. Does nothing without that variable. Ignores errors.
class Notifier {
 public:
  using Clock = std::chrono::steady_clock;

  /// Removes NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID from the environment, so that no child
  /// uses them. Construct it before any thread starts.
  Notifier();

  /// The program is ready; `sentence` becomes the status of the service.
  void ready(const std::string& sentence);
  /// Changes the status, if it differs.
  void status(const std::string& sentence);
  /// The program ends, which may take up to `longest`.
  void stopping(const std::string& sentence, std::chrono::milliseconds longest);
  /// Call it several times a second: feeds the watchdog at half of its interval.
  void turn(Clock::time_point now);

 private:
  void send(const std::string& state) const;

  std::string socket_;  ///< empty: none
  std::optional<Clock::duration> heartbeat_;
  Clock::time_point next_heartbeat_;
  std::string status_;
};

}  // namespace oblique::protocol
