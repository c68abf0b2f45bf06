#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/output/work_line.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::client {

/// One refinement: a model and its name, as "n = 8".
struct Level {
  std::string name;
  solver::ModelParameters model;
};

/// Meshes from `coarsest` to `finest` elements a link, doubled each time. The steps of the
/// explicit integrator are those it chooses on each mesh; those of generalized-alpha do not depend
/// on the mesh and stay. Throws InputError unless finest is coarsest times 4, 8, 16, ...
std::vector<Level> mesh_levels(const solver::ModelParameters& model, int coarsest, int finest);

/// Steps of contact and fall, both halved each time, from those that the model takes at e_star;
/// where it steps shorter in restitution, the shorter step throughout. Where the fall chooses its
/// steps by the tolerance, all levels share it; see exact_fall_level().
std::vector<Level> step_levels(const solver::ModelParameters& model, double e_star, int halvings);

/// Part of the fall's tolerance for which a fall counts as exact beside it, and the least tolerance
/// that models may have.
inline constexpr double kExactFall = 0.1;
inline constexpr double kTightestFall = 1e-9;

/// `level` with its contact as it is, of a step that is given, on an exact fall: what changes is
/// the error of the fall. Nothing where the fall has a step to halve.
std::optional<Level> exact_fall_level(const Level& level);

struct ContactPoint {
  double H_m;
  double mu;
  double e_star;
};

/// The contacts of `points`, side by side in lanes, in their order. Throws what the first point
/// that fails throws when it is alone.
std::vector<solver::CaseResult> contacts_of(const solver::Finger& finger,
                                            const std::vector<ContactPoint>& points);

/// What one level gave, in the order of the points.
struct SolvedLevel {
  Level level;
  std::vector<solver::CaseResult> results;
  double wall_s = 0.0;  ///< fall and contacts
};

/// Solves `points` on every level, the levels side by side on the cores of this machine, those of
/// the finest meshes first. Levels whose falls are the same share one. `line` shows what is under
/// way; `after_each` is called as each level ends, from its thread, one call at a time. Throws what
/// the solver throws.
std::vector<SolvedLevel> solve_levels(const std::vector<Level>& levels,
                                      const std::vector<ContactPoint>& points, WorkLine& line,
                                      const std::function<void(const SolvedLevel&)>& after_each);

}  // namespace oblique::client
