#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>

namespace oblique::protocol {

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
