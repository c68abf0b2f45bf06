#pragma once

#include <chrono>
#include <csignal>

#include "proto/system/descriptor.h"

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

}  // namespace oblique::protocol
