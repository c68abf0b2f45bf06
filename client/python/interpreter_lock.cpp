#include "client/python/interpreter_lock.h"

#include <unistd.h>

namespace oblique::python {
namespace {

bool python_ends() {
#if PY_VERSION_HEX >= 0x030D0000
  return Py_IsFinalizing() != 0;
#else
  return _Py_IsFinalizing() != 0;
#endif
}

[[noreturn]] void stop_for_good() {
  while (true) {
    pause();
  }
}

}  // namespace

void WithoutLock::take() noexcept {
  if (python_ends()) {
    stop_for_good();
  }
  try {
    PyEval_RestoreThread(state_);
  } catch (...) {  // pthread_exit of a Python that began to end just then
    stop_for_good();
  }
}

bool is_main_thread() {
  const auto main = pybind11::module_::import("threading").attr("main_thread")();
  return main.attr("ident").cast<unsigned long>() == PyThread_get_thread_ident();
}

}  // namespace oblique::python
