#include "proto/program/stop_signals.h"

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <system_error>

namespace oblique::protocol {
namespace {

[[noreturn]] void fail(int error, const char* what) {
  throw std::system_error(error, std::generic_category(), what);
}

bool is_ignored(int signal) {
  struct sigaction action {};
  return sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

}  // namespace

StopSignals::StopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  if (!is_ignored(SIGHUP)) {
    sigaddset(&signals, SIGHUP);
  }
  descriptor_ = Descriptor(signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC));
  if (!descriptor_.is_open()) {
    fail(errno, "cannot watch for signals");
  }
  if (const int error = pthread_sigmask(SIG_BLOCK, &signals, &before_); error != 0) {
    fail(error, "cannot block signals");
  }
}

StopSignals::~StopSignals() {
  (void)requested();  // who polled the descriptor has heeded it; unblocked it would end the program
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

bool StopSignals::requested() {
  signalfd_siginfo received{};
  while (read(descriptor(), &received, sizeof(received)) == sizeof(received)) {
    signal_ = signal_ == 0 ? static_cast<int>(received.ssi_signo) : signal_;
  }
  return signal_ > 0;
}

bool StopSignals::wait(std::chrono::nanoseconds longest) {
  if (signal_ > 0) {
    return true;
  }
  const auto left = std::clamp<std::int64_t>(
      std::chrono::ceil<std::chrono::milliseconds>(longest).count(), 0, INT32_MAX);
  pollfd item{descriptor(), POLLIN, 0};
  static_cast<void>(poll(&item, 1, static_cast<int>(left)));
  return requested();
}

void survive_failed_writes() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

}  // namespace oblique::protocol
