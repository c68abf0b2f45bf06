#include <exception>
#include <filesystem>

#include <pybind11/pybind11.h>

#include "client/python/database.h"
#include "client/python/solving.h"
#include "server/database/sqlite.h"
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

/// What the package oblique (folder oblique/) is made over.
PYBIND11_MODULE(_core, module) {
  namespace py = pybind11;
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
