#pragma once

#include <csignal>

#include <chrono>

namespace oblique::client {

/// While it lives, SIGINT, SIGTERM and SIGHUP no longer end the program but are noticed here. Make
/// it before any thread is started, for threads inherit what is blocked.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// Whether one of the signals has come.
  bool requested();

  /// Waits for a signal, at most `longest`; whether one has come.
  bool wait(std::chrono::nanoseconds longest);

  /// The exit code of a program that ends because of the signal that came: 128 and its number, as
  /// shells say it; 130 for Ctrl-C.
  int exit_code() const { return 128 + signal_; }

 private:
  sigset_t signals_{};
  sigset_t before_{};
  int signal_ = 0;  ///< 0: none came
};

}  // namespace oblique::client
