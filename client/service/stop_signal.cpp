#include "client/service/stop_signal.h"

#include <pthread.h>

#include <ctime>

#include <algorithm>

namespace oblique::client {

StopSignal::StopSignal() {
  sigemptyset(&signals_);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    sigaddset(&signals_, signal);
  }
  pthread_sigmask(SIG_BLOCK, &signals_, &before_);
}

StopSignal::~StopSignal() {
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

bool StopSignal::requested() {
  return wait(std::chrono::nanoseconds::zero());
}

bool StopSignal::wait(std::chrono::nanoseconds longest) {
  if (signal_ > 0) {
    return true;
  }
  const auto left = std::max(longest, std::chrono::nanoseconds::zero());
  const auto seconds = std::chrono::floor<std::chrono::seconds>(left);
  timespec time{};
  time.tv_sec = seconds.count();
  time.tv_nsec = (left - seconds).count();
  signal_ = std::max(sigtimedwait(&signals_, nullptr, &time), 0);
  return signal_ > 0;
}

}  // namespace oblique::client
