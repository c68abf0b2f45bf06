#pragma once

#include <sys/types.h>

#include <chrono>
#include <csignal>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "proto/system/descriptor.h"

// What a program that runs long has to do with signals, its parent and the service manager.
namespace oblique::protocol {

/// While it lives, SIGINT, SIGTERM and SIGHUP no longer end the program but are noticed here;
/// SIGHUP not where whoever started the program had it ignored, as nohup does. Make it before any
/// thread is started, for threads inherit what is blocked.
class StopSignals {
 public:
  /// Throws std::system_error when signals cannot be watched.
  StopSignals();
  /// Takes the signals that are there: who heeds the descriptor alone ends in order.
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Readable while a signal is there that nobody has taken.
  int descriptor() const { return descriptor_.number(); }

  /// Whether one of the signals has come so far; takes those that are there.
  bool requested();

  /// Waits for a signal, at most `longest`; whether one has come so far.
  bool wait(std::chrono::nanoseconds longest);

  /// The exit code of a program that ends because of the signal that came first: 128 and its
  /// number, as shells say it; 130 for Ctrl-C.
  int exit_code() const { return 128 + signal_; }

 private:
  sigset_t before_{};
  Descriptor descriptor_;
  int signal_ = 0;  ///< 0: none came
};

/// Lets writing fail with an error instead of ending the program: to a pipe that nobody reads, and
/// to a file that may not grow further, which is a full disk and no reason to die.
void survive_failed_writes();

/// The option --stop-with-parent [PID] of programs that others start: when the process that started
/// this one ends, this one gets SIGTERM, even if the parent had no time to say anything.
class StopWithParent {
 public:
  /// To be made as the program begins: who is the parent now counts.
  StopWithParent();

  /// Adds the option. This must live as long as `app`.
  void add_to(CLI::App& app);

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

/// Tells the service manager (systemd) how the program is, by datagrams to the socket of the
/// environment variable NOTIFY_SOCKET, which may be an abstract one. Without it all calls do
/// nothing, and errors are passed over: nobody is there to hear of them.
class Notifier {
 public:
  using Clock = std::chrono::steady_clock;

  /// Takes NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID out of the environment, so that no child
  /// speaks for this process. Make it before any thread is started.
  Notifier();

  /// The program can be used; `sentence` is what people see in the status of the service.
  void ready(const std::string& sentence);
  /// What people see from now on, if it is another.
  void status(const std::string& sentence);
  /// The program ends, which may take up to `longest`.
  void stopping(const std::string& sentence, std::chrono::milliseconds longest);
  /// To be called as the program's loop turns, several times a second: says that it lives, at half
  /// of the time within which the service manager wants to hear that.
  void turn(Clock::time_point now);

 private:
  void send(const std::string& state) const;

  std::string socket_;  // empty: nobody listens
  std::optional<Clock::duration> heartbeat_;
  Clock::time_point next_heartbeat_;
  std::string status_;
};

}  // namespace oblique::protocol
