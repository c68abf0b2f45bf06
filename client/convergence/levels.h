#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/io/status_line.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// One refinement: a model and its name, as "n = 8".
struct Level {
  std::string name;
  solver::ModelParameters model;
};

/// Meshes from `coarsest` to `finest` elements a link, doubled each time. The explicit integrator
/// chooses its steps on each mesh; those of generalized-alpha do not depend on the mesh and stay.
/// Throws InputError unless finest is coarsest times 4, 8, 16, ...
std::vector<Level> mesh_levels(const solver::ModelParameters& model, int coarsest, int finest);

/// Steps of contact and fall, both halved each time, from those that the model takes at e_star;
/// where restitution takes shorter steps, the shorter step throughout. Where the fall chooses its
/// steps by the tolerance, all levels share it; see exact_fall_level().
std::vector<Level> step_levels(const solver::ModelParameters& model, double e_star, int halvings);

/// `level` with the same contact on a fall solved for a tenth of the tolerance, which shows the
/// error of the fall. Nothing where the fall has a step to halve.
std::optional<Level> exact_fall_level(const Level& level);

struct ContactPoint {
  double H_m;
  double mu;
  double e_star;
};

/// A level with the result of the point on it.
struct SolvedLevel {
  Level level;
  solver::CaseResult result;
  double wall_s = 0.0;  ///< fall and contact
};

/// Solves `point` on every level, all levels side by side. Levels whose falls are the same share
/// one. `line` shows what is under way; `after_each` is called as each level ends, from its thread,
/// one call at a time. Throws InputError and SolveError as the solver does.
std::vector<SolvedLevel> solve_levels(const std::vector<Level>& levels, const ContactPoint& point,
                                      StatusLine& line,
                                      const std::function<void(const SolvedLevel&)>& after_each);

}  // namespace oblique::client
