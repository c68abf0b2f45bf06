#pragma once

#include <pybind11/pybind11.h>

namespace oblique::python {

/// While it lives, this thread leaves the interpreter's lock to others. Where Python ends
/// meanwhile, as it does under a daemon thread, the thread stops for good when it would take the
/// lock again: Python itself ends such a thread by unwinding its stack, and destructors may not be
/// unwound.
class WithoutLock {
 public:
  WithoutLock() : state_(PyEval_SaveThread()) {}
  ~WithoutLock() { take(); }
  WithoutLock(const WithoutLock&) = delete;
  WithoutLock& operator=(const WithoutLock&) = delete;

  /// Gives what `call` gives, which has the lock.
  template <class Call>
  auto with_lock(const Call& call) {
    take();
    const struct Giving {
      WithoutLock& without;
      ~Giving() { without.state_ = PyEval_SaveThread(); }
    } giving{*this};
    return call();
  }

 private:
  void take() noexcept;

  PyThreadState* state_;
};

/// Whether this thread, which has the lock, is the one in which handlers of signals run.
bool is_main_thread();

}  // namespace oblique::python
