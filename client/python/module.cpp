#include <unistd.h>

#include <exception>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include <pybind11/pybind11.h>

#include "client/python/interpreter.h"
#include "server/database/sqlite.h"
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::python {

void WithoutLock::take() noexcept {
#if PY_VERSION_HEX >= 0x030D0000
  const bool python_ends = Py_IsFinalizing() != 0;
#else
  const bool python_ends = _Py_IsFinalizing() != 0;
#endif
  try {
    if (!python_ends) {
      PyEval_RestoreThread(state_);
      return;
    }
  } catch (...) {  // pthread_exit, called because Python is ending
  }
  while (true) {
    pause();
  }
}

void refuse_forked_child() {
  static const pid_t process = getpid();
  if (getpid() != process) {
    throw std::runtime_error(
        "oblique cannot be used in the child of a fork: start processes with "
        "multiprocessing.set_start_method(\"spawn\")");
  }
}

}  // namespace oblique::python

/// The extension module oblique._core of the package oblique (folder oblique/).
PYBIND11_MODULE(_core, module) {
  namespace py = pybind11;
  oblique::python::refuse_forked_child();
  py::register_exception<oblique::solver::SolveError>(module, "SolveError", PyExc_ArithmeticError);
  static PyObject* const database_error =
      py::register_exception<oblique::server::StorageError>(module, "DatabaseError").ptr();
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(std::move(thrown));
    } catch (const oblique::solver::InputError& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    } catch (const oblique::server::StatementError& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    } catch (const oblique::server::NoSuchStudy& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    } catch (const oblique::server::QueryError& error) {
      PyErr_SetString(database_error, error.what());
    } catch (const std::filesystem::filesystem_error& error) {
      PyErr_SetString(PyExc_FileNotFoundError,
                      ("there is no database " + error.path1().string()).c_str());
    }
  });
  oblique::python::add_solving(module);
  oblique::python::add_database(module);
}
