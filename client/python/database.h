#pragma once

#include <pybind11/pybind11.h>

namespace oblique::python {

/// Adds the class Database, which asks a file.
void add_database(pybind11::module_& module);

}  // namespace oblique::python
