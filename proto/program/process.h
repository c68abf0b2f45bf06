#pragma once

#include <sys/types.h>

#include <chrono>
#include <csignal>
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

/// Adds --stop-with-parent PID, which sets `parent`.
void add_stop_with_parent(CLI::App& app, pid_t& parent);

/// Requests SIGTERM for the end of the process `parent`, which started this one; nothing for 0.
/// Call it when signals are watched. False when the parent has ended already.
bool stop_with_parent(pid_t parent);

/// Sends the state of the program to the service manager (systemd), as datagrams to the socket
/// NOTIFY_SOCKET, a path. Does nothing without that variable. Ignores errors.
class Notifier {
 public:
  using Clock = std::chrono::steady_clock;

  Notifier();

  /// The program is ready; `sentence` becomes the status of the service.
  void ready(const std::string& sentence) const;
  /// Changes the status, if it differs.
  void status(const std::string& sentence);
  /// The program ends, which may take up to `longest`.
  void stopping(const std::string& sentence, std::chrono::milliseconds longest) const;
  /// Call it several times a second: feeds the watchdog at half of WATCHDOG_USEC.
  void feed_watchdog(Clock::time_point now);

 private:
  void send(const std::string& state) const;

  std::string socket_;         ///< empty: none
  Clock::duration heartbeat_;  ///< 0: none
  Clock::time_point next_heartbeat_;
  std::string status_;
};

}  // namespace oblique::protocol
