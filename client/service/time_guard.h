#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace oblique::client {

/// Ends the program with exit code 1 and a sentence on standard error unless it is destroyed in
/// time: for a call into a library that nothing else can stop. The program must have nothing left
/// to undo.
class TimeGuard {
 public:
  TimeGuard(std::chrono::milliseconds limit, std::string sentence);
  ~TimeGuard();
  TimeGuard(const TimeGuard&) = delete;
  TimeGuard& operator=(const TimeGuard&) = delete;

 private:
  void run();

  const std::chrono::steady_clock::time_point end_;
  const std::string sentence_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool done_ = false;   // guarded by mutex_
  std::thread thread_;  // last: it uses all the others
};

}  // namespace oblique::client
