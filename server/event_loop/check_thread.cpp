#include "server/event_loop/check_thread.h"

#include <utility>

namespace oblique::server {

void CompletionQueue::put(Completion completion) {
  {
    const std::lock_guard lock(mutex_);
    completions_.push_back(std::move(completion));
  }
  woken_.wake();
}

void CompletionQueue::run() {
  woken_.clear();
  std::vector<Completion> completions;
  {
    const std::lock_guard lock(mutex_);
    completions.swap(completions_);
  }
  for (Completion& completion : completions) {
    completion();
  }
}

CheckThread::CheckThread(Done done) : done_(std::move(done)), thread_([this] { run(); }) {}

CheckThread::~CheckThread() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
  }
  thread_.join();
}

void CheckThread::submit(Ports::Check check) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(check));
  wake_.notify_all();
}

void CheckThread::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return stopping_ || !waiting_.empty(); });
    if (stopping_) {
      return;
    }
    const Ports::Check check = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    done_(check());
    lock.lock();
  }
}

}  // namespace oblique::server
