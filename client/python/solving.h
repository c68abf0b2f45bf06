#pragma once

#include <pybind11/pybind11.h>

namespace oblique::python {

/// Adds what solves points: solve, solve_many, trace, and what they are made of.
void add_solving(pybind11::module_& module);

}  // namespace oblique::python
