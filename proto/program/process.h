#pragma once

#include <sys/resource.h>
#include <sys/types.h>

#include <chrono>
#include <csignal>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>

#include "proto/system/descriptor.h"

// Standard streams, limits, signals, parent process and service manager of the programs.
namespace oblique::protocol {

/// Prepares this process; the first call of `main`. Opens missing standard streams on the null
/// device, because other files would take their place. Makes a write beyond the file size limit
/// return an error. Raises the limit on open files to `wanted_files` if that is allowed. Ends the
/// process with exit code 1 and a sentence if the limit is below 64, and later if memory or threads
/// run out where nothing catches the exception.
void prepare_process(rlim_t wanted_files = 64);

/// Returns the message of `error`, with the remedy if memory or threads have run out.
const char* failure_text(const std::exception& error);

/// Returns the value of an environment variable; empty if it is not set. Containers and units set a
/// variable to an empty text in order to omit it.
std::string environment_value(const std::string& name);

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

/// Adds the option --stop-with-parent PID, which sets `parent`.
void add_stop_with_parent(CLI::App& app, pid_t& parent);

/// Makes the system send SIGTERM when the parent process `parent` ends; does nothing for 0. Must be
/// called while StopSignals exists. Returns false if the parent has already ended.
bool stop_with_parent(pid_t parent);

/// Reports the state of the program to systemd, in datagrams to the socket at the path in
/// NOTIFY_SOCKET, or to a process that forwards them. Does nothing if that variable is not set.
/// Ignores errors.
class Notifier {
 public:
  using Clock = std::chrono::steady_clock;

  /// `forwarder` is a connected socket that gets the messages instead; -1: none.
  explicit Notifier(int forwarder = -1);

  /// Reports that the program is ready. `sentence` becomes the status of the service.
  void ready(const std::string& sentence) const;
  /// Sets the status of the service.
  void status(const std::string& sentence);
  /// Reports that the program is stopping, and that this may take up to `longest`.
  void stopping(const std::string& sentence, std::chrono::milliseconds longest) const;
  /// Sends a keep-alive each time half of WATCHDOG_USEC has passed. Must be called several times a
  /// second.
  void feed_watchdog(Clock::time_point now);
  /// Sends a message in the format of sd_notify(3).
  void send(std::string_view state) const;

 private:
  int forwarder_;
  std::string socket_;         ///< empty: none
  Clock::duration heartbeat_;  ///< 0: none
  Clock::time_point next_heartbeat_;
  std::string status_;
};

}  // namespace oblique::protocol
