#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "worker/solver/library/solver.h"

namespace oblique::python {

/// What a caller said of some points: keys of models and of points, as on flags.
struct GivenKeys {
  std::size_t points = 1;
  std::string preset{solver::preset_names().front()};
  std::vector<double> lengths_m;                      ///< empty: by `links` and `length`
  std::map<std::string, double> numbers;              ///< one value for all points
  std::map<std::string, std::string> texts;           ///< expressions, and the integrator's name
  std::map<std::string, std::vector<double>> arrays;  ///< one value a point
};

/// The points with their models, for solve_many.
struct GivenPoints {
  std::vector<ModelParameters> models;
  std::vector<std::string> faults;  ///< of each model, why it is none; empty: it is one
  std::vector<Point> points;
};

/// Throws InputError, naming key, value and what is allowed, with the nearest name for an unknown
/// key, for all that is wrong with every point. What is wrong with single points of arrays is found
/// when they are solved, or is a fault of their model.
GivenPoints points_of(const GivenKeys& given);

}  // namespace oblique::python
