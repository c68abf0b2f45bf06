#include "client/service/time_guard.h"

#include <unistd.h>

#include <utility>

#include "proto/program/usage.h"

namespace oblique::client {

TimeGuard::TimeGuard(std::chrono::milliseconds limit, std::string sentence)
    : end_(std::chrono::steady_clock::now() + limit),
      sentence_(std::move(sentence) + "\n"),
      thread_([this] { run(); }) {}

TimeGuard::~TimeGuard() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
    wake_.notify_one();
  }
  thread_.join();
}

void TimeGuard::run() {
  std::unique_lock lock(mutex_);
  if (!wake_.wait_until(lock, end_, [this] { return done_; })) {
    // The other thread is anywhere: no stream, no destructor.
    (void)!::write(STDERR_FILENO, sentence_.data(), sentence_.size());
    _exit(protocol::kFailed);
  }
}

}  // namespace oblique::client
