#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

namespace oblique::python {

void add_solving(pybind11::module_& module);
void add_database(pybind11::module_& module);

/// Creates a NumPy array that owns the values.
template <class T>
pybind11::array_t<T> array_of(std::vector<T>&& values) {
  auto* const owned = new std::vector<T>(std::move(values));  // the capsule below deletes it
  const pybind11::capsule owner(owned,
                                [](void* kept) { delete static_cast<std::vector<T>*>(kept); });
  return pybind11::array_t<T>(static_cast<pybind11::ssize_t>(owned->size()), owned->data(), owner);
}

/// Releases the lock of the Python interpreter while this object exists. If Python ends during that
/// time, which can happen under a daemon thread, this thread blocks for ever and does not take the
/// lock again. Otherwise Python would unwind the thread's stack, which C++ destructors do not
/// survive.
class WithoutLock {
 public:
  WithoutLock() : state_(PyEval_SaveThread()) {}
  ~WithoutLock() { take(); }
  WithoutLock(const WithoutLock&) = delete;
  WithoutLock& operator=(const WithoutLock&) = delete;

  void with_lock(const std::function<void()>& call) {
    take();
    const struct Release {
      WithoutLock& without;
      ~Release() { without.state_ = PyEval_SaveThread(); }
    } release{*this};
    call();
  }

 private:
  void take() noexcept;

  PyThreadState* state_;
};

/// Throws an error (RuntimeError in Python) in the child of a fork, where threads and locks of the
/// parent are unusable. The module calls this function first when it is imported.
void refuse_forked_child();

/// Thrown by work that was stopped.
class Stopped {};

/// Runs `work` on its own thread without the interpreter's lock and returns its result. The calling
/// thread handles signals and calls `meanwhile` every 50 ms. If a signal (Ctrl-C) or `meanwhile`
/// raises an exception, sets `stop`, calls `when_stopped` and soon throws the exception. `work` may
/// still run at that time, so it must own all data that it uses.
template <class Result>
Result interruptibly(const std::function<Result(const std::atomic<bool>& stop)>& work,
                     const std::function<void()>& when_stopped = {},
                     const std::function<void()>& meanwhile = {}) {
  constexpr std::chrono::milliseconds kBetweenSignalChecks{50};
  constexpr std::chrono::milliseconds kLongestWait{150};
  refuse_forked_child();
  const auto stop = std::make_shared<std::atomic<bool>>(false);
  WithoutLock others_run;
  std::packaged_task<Result()> task([stop, work] { return work(*stop); });
  auto result = task.get_future();
  std::thread thread(std::move(task));
  while (result.wait_for(kBetweenSignalChecks) != std::future_status::ready) {
    try {
      others_run.with_lock([&meanwhile] {
        if (PyErr_CheckSignals() != 0) {
          throw pybind11::error_already_set();
        }
        if (meanwhile) {
          meanwhile();
        }
      });
    } catch (...) {
      *stop = true;
      if (when_stopped) {
        when_stopped();
      }
      const bool has_ended = result.wait_for(kLongestWait) == std::future_status::ready;
      has_ended ? thread.join() : thread.detach();
      throw;
    }
  }
  thread.join();
  return result.get();
}

}  // namespace oblique::python
