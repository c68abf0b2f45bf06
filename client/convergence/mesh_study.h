#pragma once

#include <cstddef>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/convergence/convergence_report.h"
#include "client/convergence/levels.h"

namespace oblique::client {

/// One output over the points of a mesh study: how far each level is from the limits that
/// extrapolation finds, relative to each point's limit. Peaks of F_n count as one output, reactions
/// too: the worst of a point's.
struct OutputStudy {
  std::string name;
  /// One a level and point, coarsest level first; nothing where the mode up to it is another one
  /// than on the finest level. Points whose limit is 0, as stick where there is none, are left out.
  std::vector<std::vector<std::optional<double>>> errors;

  std::size_t points() const { return errors.front().size(); }
  /// Largest and middle error of those points that have one; nothing when none has.
  std::optional<double> largest(std::size_t level) const;
  std::optional<double> median(std::size_t level) const;
  /// How many points are within `tolerance`; those of another mode are not.
  std::size_t within(std::size_t level, double tolerance) const;
};

/// An output of one point that a level does not give within the tolerance.
struct Miss {
  std::size_t point;
  std::string output;
  std::optional<double> error;  ///< relative; nothing: the mode is another one
  double limit;
};

/// How good each mesh is for a number of points.
struct MeshStudy {
  /// A mesh is good enough when each output is within the tolerance at this part of its points:
  /// exit velocities pass through zero, so that no mesh has them all.
  static constexpr double kMostPoints = 0.8;

  std::vector<std::string> levels;  ///< names, coarsest first
  std::size_t points;
  double tolerance;  ///< relative
  std::vector<OutputStudy> outputs;
  /// What each level misses, in the order of the points.
  std::vector<std::vector<Miss>> misses;
  /// The coarsest level from which on all are good enough; nothing when not even the finest is.
  std::optional<std::size_t> chosen;
};

/// Judges refinements of the same levels, one a point; not empty.
MeshStudy study_of(const std::vector<Refinement>& points, double tolerance);

/// Tables of errors and of how many points are within the tolerance, the level chosen, and what it
/// misses.
void print_study(std::ostream& out, const MeshStudy& study,
                 const std::vector<ContactPoint>& points);

/// The same as a JSON object.
nlohmann::ordered_json json_of(const MeshStudy& study);

}  // namespace oblique::client
