#pragma once

#include <sys/types.h>

#include <chrono>
#include <csignal>
#include <string>

#include <CLI/CLI.hpp>

#include "proto/system/descriptor.h"

// Signals, parent process and service manager of long-running programs.
namespace oblique::protocol {

/// While this object exists, SIGINT, SIGTERM and SIGHUP make a descriptor readable instead of
/// ending the program. If SIGHUP was ignored when the program started, for example by nohup, it
/// stays ignored. The object must be created before any thread starts, because threads inherit the
/// signal mask.
class StopSignals {
 public:
  /// Throws std::system_error if the system refuses.
  StopSignals();
  /// Discards pending signals, which would end the program when they are unblocked.
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Becomes readable when a signal is pending.
  int descriptor() const { return descriptor_.number(); }

  /// Returns whether a signal has ever arrived. Consumes pending signals.
  bool requested();
  /// Waits for a signal, for at most `longest`, and returns whether one has ever arrived.
  bool wait(std::chrono::nanoseconds longest);

  /// Returns 128 plus the number of the first signal, as shells do; for Ctrl-C this is 130.
  int exit_code() const { return 128 + signal_; }

 private:
  sigset_t before_{};
  Descriptor descriptor_;
  int signal_ = 0;  ///< number of the first signal; 0 if none has arrived
};

/// Makes a write to a pipe without a reader, or beyond the file size limit, return an error instead
/// of ending the program.
void survive_failed_writes();

/// Adds the option --stop-with-parent PID, which sets `parent`.
void add_stop_with_parent(CLI::App& app, pid_t& parent);

/// Makes the system send SIGTERM when the parent process `parent` ends; does nothing for 0. Must be
/// called while StopSignals exists. Returns false if the parent has already ended.
bool stop_with_parent(pid_t parent);

/// Reports the state of the program to systemd, in datagrams to the socket at the path in
/// NOTIFY_SOCKET. Does nothing if that variable is not set. Ignores errors.
class Notifier {
 public:
  using Clock = std::chrono::steady_clock;

  Notifier();

  /// Reports that the program is ready. `sentence` becomes the status of the service.
  void ready(const std::string& sentence) const;
  /// Sets the status of the service.
  void status(const std::string& sentence);
  /// Reports that the program is stopping, and that this may take up to `longest`.
  void stopping(const std::string& sentence, std::chrono::milliseconds longest) const;
  /// Sends a keep-alive each time half of WATCHDOG_USEC has passed. Must be called several times a
  /// second.
  void feed_watchdog(Clock::time_point now);

 private:
  void send(const std::string& state) const;

  std::string socket_;         ///< empty: none
  Clock::duration heartbeat_;  ///< 0: none
  Clock::time_point next_heartbeat_;
  std::string status_;
};

}  // namespace oblique::protocol
