#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "proto/oblique.pb.h"
#include "proto/recipe/written.h"
#include "worker/solver/library/solver.h"

namespace oblique::python {

/// The keys of some points: those of the model that are one number, and all others by their
/// numbers (key_number).
struct GivenKeys {
  std::size_t points;
  protocol::WrittenModel model;
  std::map<std::size_t, protocol::Axis> axes;
};

/// Reads a dict of numbers, texts (expressions), arrays of `points` values, and a list `lengths`.
/// Throws InputError, which names key, value and what is allowed, for a value that is wrong for all
/// points, and for an unknown key, with the nearest one.
GivenKeys keys_of(const pybind11::dict& keys, std::size_t points);

/// The points with their models, for solve_many.
struct GivenPoints {
  std::vector<ModelParameters> models;
  std::vector<std::string> faults;  ///< of each model; empty: the model can be solved
  std::vector<ModelPoint> points;
};

/// Needs no lock of the interpreter. Throws InputError for wrong expressions and combinations. A
/// wrong value in an array makes a fault of its model, or fails when the point is solved.
GivenPoints points_of(const GivenKeys& given);

}  // namespace oblique::python
