#pragma once

#include <sys/types.h>

#include <chrono>
#include <csignal>
#include <string>

#include <CLI/CLI.hpp>

#include "proto/system/descriptor.h"

// Signals, the parent process and the service manager, for long-running programs.
namespace oblique::protocol {

/// While this object exists, SIGINT, SIGTERM and SIGHUP make a descriptor readable instead of
/// ending the program. A SIGHUP that was ignored at the start, as by nohup, stays ignored. Create
/// it before any thread starts, because threads inherit the signal mask.
class StopSignals {
 public:
  /// Throws std::system_error if the system refuses.
  StopSignals();
  /// Discards pending signals, which would end the program when they are unblocked.
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Readable while a signal is pending.
  int descriptor() const { return descriptor_.number(); }

  /// Whether a signal has arrived so far; consumes pending ones.
  bool requested();
  /// The same, after waiting for a signal for at most `longest`.
  bool wait(std::chrono::nanoseconds longest);

  /// 128 plus the number of the first signal, as shells do: 130 for Ctrl-C.
  int exit_code() const { return 128 + signal_; }

 private:
  sigset_t before_{};
  Descriptor descriptor_;
  int signal_ = 0;  ///< the first; 0: none
};

/// Makes a write to a pipe without a reader, or beyond the file size limit, return an error instead
/// of ending the program.
void survive_failed_writes();

/// Adds --stop-with-parent PID, which sets `parent`.
void add_stop_with_parent(CLI::App& app, pid_t& parent);

/// Makes the system send SIGTERM when the parent process `parent` ends; does nothing for 0. Call it
/// while StopSignals exists. False if the parent has already ended.
bool stop_with_parent(pid_t parent);

/// Sends the state of the program to systemd, as datagrams to the socket path in NOTIFY_SOCKET.
/// Does nothing without that variable. Ignores errors.
class Notifier {
 public:
  using Clock = std::chrono::steady_clock;

  Notifier();

  /// Reports that the program is ready, with `sentence` as the status of the service.
  void ready(const std::string& sentence) const;
  /// Sets the status of the service.
  void status(const std::string& sentence);
  /// Reports that the program is stopping, which may take up to `longest`.
  void stopping(const std::string& sentence, std::chrono::milliseconds longest) const;
  /// Sends a keep-alive at half of WATCHDOG_USEC. To be called several times a second.
  void feed_watchdog(Clock::time_point now);

 private:
  void send(const std::string& state) const;

  std::string socket_;         ///< empty: none
  Clock::duration heartbeat_;  ///< 0: none
  Clock::time_point next_heartbeat_;
  std::string status_;
};

}  // namespace oblique::protocol
