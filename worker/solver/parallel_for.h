#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace oblique::solver {

/// Calls `task` with 0, 1, ..., count - 1 on the calling thread and up to `threads` - 1 others; on
/// fewer if the system refuses threads. After an exception no further task begins, and the
/// exception is rethrown when all tasks have ended.
inline void parallel_for(std::size_t count, std::size_t threads,
                         const std::function<void(std::size_t)>& task) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    for (std::size_t number = next++; number < count; number = next++) {
      try {
        task(number);
      } catch (...) {
        next = count;
        const std::lock_guard lock(mutex);
        failure = failure ? failure : std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> helpers;
    try {
      while (helpers.size() + 1 < std::min(count, threads)) {
        helpers.emplace_back(work);
      }
    } catch (const std::exception&) {  // the threads already started do the work
    }
    work();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

}  // namespace oblique::solver
