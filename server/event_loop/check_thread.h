#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "proto/system/descriptor.h"
#include "server/service/ports/ports.h"

namespace oblique::server {

/// Work that other threads leave for the event loop, which a descriptor wakes.
class CompletionQueue {
 public:
  using Completion = std::function<void()>;

  /// Thread-safe.
  void put(Completion completion);
  /// Called by the loop: runs everything that was put before.
  void run();
  /// Readable when there is something to run.
  int descriptor() const { return woken_.descriptor(); }

 private:
  protocol::WakeUp woken_;
  std::mutex mutex_;
  std::vector<Completion> completions_;  // guarded by mutex_
};

/// Runs checks that take long, in order, on a thread of its own. How many wait is bounded by those
/// who submit them.
class CheckThread {
 public:
  using Done = std::function<void(Ports::Completion)>;

  /// `done` is called on the thread after each check.
  explicit CheckThread(Done done);
  /// Drops the checks that wait, and waits for the one that runs.
  ~CheckThread();
  CheckThread(const CheckThread&) = delete;
  CheckThread& operator=(const CheckThread&) = delete;

  void submit(Ports::Check check);

 private:
  void run();

  Done done_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Ports::Check> waiting_;  // guarded by mutex_
  bool stopping_ = false;             // guarded by mutex_
  std::thread thread_;                // last: it uses the other members
};

}  // namespace oblique::server
