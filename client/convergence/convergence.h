#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/convergence/contact_changes.h"
#include "client/convergence/richardson.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// A scalar that a contact gives.
struct Output {
  std::string name;  ///< with its unit, as results have it; `major_peak_2_N` is the second one
  double value;
  /// Largest force, duration, speed at touch, ...: what errors are small against. Digits below 1e-9
  /// of it are rounding.
  double scale;
  /// States up to the instant that makes the value, ripples merged. Values of two levels are the
  /// same quantity when this is the same.
  std::string mode;
};

/// fn_peak, ft_peak, every major peak, duration, stick, slide, impulses and exit velocity.
std::vector<Output> outputs_of(const solver::CaseResult& result);

/// One refinement: a model and its name, as "n = 8".
struct Level {
  std::string name;
  solver::ModelParameters model;
};

/// Meshes from `coarsest` to `finest` elements a link, doubled each time. The steps of the
/// explicit integrator are those it chooses on each mesh, except that the fall takes the longest
/// that are safe (its steps are far shorter than its motion asks for, and most of the work); those
/// of generalized-alpha do not depend on the mesh and stay. Throws InputError unless finest is
/// coarsest times 4, 8, 16, ...
std::vector<Level> mesh_levels(const solver::ModelParameters& model, int coarsest, int finest);

/// Steps of contact and fall, both halved each time, from those that the model takes at e_star;
/// where it steps shorter in restitution, the shorter step throughout.
std::vector<Level> step_levels(const solver::ModelParameters& model, double e_star, int halvings);

struct ContactPoint {
  double H_m;
  double mu;
  double e_star;
};

/// What one level gave, in the order of the points.
struct SolvedLevel {
  Level level;
  std::vector<solver::CaseResult> results;
  double wall_s = 0.0;  ///< fall and contacts
};

/// Solves `points` on every level, the levels side by side on the cores of this machine, the last
/// (dearest) first. `after_each` is called as each level ends, from its thread, one call at a time.
/// Throws what the solver throws.
std::vector<SolvedLevel> solve_levels(const std::vector<Level>& levels,
                                      const std::vector<ContactPoint>& points,
                                      const std::function<void(const SolvedLevel&)>& after_each);

/// One output over the levels.
struct OutputConvergence {
  std::string name;
  double scale;  ///< as of the finest level's Output
  /// One a level, coarsest first; nothing where the mode differs from the finest's before.
  std::vector<std::optional<double>> values;
  /// Over the finest levels that have the value, without a gap.
  Extrapolation extrapolation;

  double finest() const { return *values.back(); }
};

/// What one level has and the next finer one has not, or the other way round.
struct LevelChange {
  std::size_t finer;  ///< number of the finer level
  ContactChange change;
};

/// One point over the levels.
struct PointConvergence {
  std::vector<OutputConvergence> outputs;
  std::vector<LevelChange> changes;
  /// Whether the finest three levels have one mode, ripples merged: outputs have a limit to be seen
  /// only then.
  bool has_one_mode = false;
};

/// Judges one point from its results, coarsest level first. `highest_order` is the order that
/// theory promises at most.
PointConvergence convergence_of(std::span<const solver::CaseResult> results, double highest_order);

/// |value - limit| / |limit|, where both are there; of a limit of 0, nothing.
std::optional<double> relative_error(const std::optional<double>& value, double limit);

}  // namespace oblique::client
