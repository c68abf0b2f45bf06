#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include <pybind11/pybind11.h>

#include "client/python/interpreter_lock.h"

namespace oblique::python {

/// How often a call looks whether somebody pressed Ctrl-C.
inline constexpr std::chrono::milliseconds kBetweenLooks{50};
/// Work that takes longer to end is left to end by itself.
inline constexpr std::chrono::milliseconds kLongestWait{150};

/// Thrown by work that nobody waits for any more.
class Stopped {};

/// Runs `work` without the interpreter's lock, and gives what it gives. For the main thread, which
/// signals reach, it runs on a thread of its own: where a signal's handler throws meanwhile, as
/// that of Ctrl-C does, `stop` is set, and soon after that is thrown, even while `work` still runs:
/// it must own all that it uses. `when_stopped` is called behind that, from here, where there is
/// one.
template <class Result>
Result interruptibly(std::function<Result(const std::atomic<bool>& stop)> work,
                     const std::function<void(const std::atomic<bool>& stop)>& when_stopped = {}) {
  if (!is_main_thread()) {
    const WithoutLock others_run;
    const std::atomic<bool> nobody_stops_it = false;
    return work(nobody_stops_it);
  }
  struct State {
    std::function<Result(const std::atomic<bool>&)> work;
    std::atomic<bool> stop = false;
    std::mutex mutex;
    std::condition_variable ended;
    bool has_ended = false;
    std::optional<Result> result;
    std::exception_ptr failure;
  };
  const auto state = std::make_shared<State>();
  state->work = std::move(work);
  bool is_interrupted = false;
  {
    WithoutLock others_run;
    std::thread thread([state] {
      std::optional<Result> result;
      std::exception_ptr failure;
      try {
        result.emplace(state->work(state->stop));
      } catch (...) {
        failure = std::current_exception();
      }
      const std::lock_guard lock(state->mutex);
      state->result = std::move(result);
      state->failure = failure;
      state->has_ended = true;
      state->ended.notify_one();
    });
    std::unique_lock lock(state->mutex);
    const auto has_ended = [&state] { return state->has_ended; };
    while (!state->ended.wait_for(lock, kBetweenLooks, has_ended) && !is_interrupted) {
      lock.unlock();
      is_interrupted = others_run.with_lock([] { return PyErr_CheckSignals() != 0; });
      lock.lock();
      if (is_interrupted) {
        state->stop = true;
        if (when_stopped) {
          when_stopped(state->stop);
        }
        if (!state->ended.wait_for(lock, kLongestWait, has_ended)) {
          break;
        }
      }
    }
    const bool is_done = state->has_ended;
    lock.unlock();
    is_done ? thread.join() : thread.detach();
  }
  if (is_interrupted) {
    throw pybind11::error_already_set();
  }
  if (state->failure) {
    std::rethrow_exception(state->failure);
  }
  return std::move(*state->result);
}

}  // namespace oblique::python
