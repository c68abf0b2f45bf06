#pragma once

#include <string>

#include "worker/solver/estimate.h"
#include "worker/solver/solve.h"
#include "worker/solver/solve_many.h"

/// The oblique impact of a flexible robotic finger on rough ground, as a library.
///
/// A chain of slender elastic links hangs from a pin O and falls from rest, straight and level. Its
/// tip strikes the ground a drop H below O, and keeps contact through a normal and a tangential
/// spring with friction and losses, until it leaves the ground. The links are absolute nodal
/// coordinate elements (equations 1 to 16 of the paper, "Oblique impact for flexible robotic finger
/// system"), the contact is its local compliant model (equations 17 to 25). What had to be
/// corrected in them stands in worker/solver/README.md of the sources.
///
///     #include <oblique/solver.h>
///     const oblique::Finger finger;                        // the preset `standard`
///     const auto impact = finger.solve(1.0, 0.4, 1.0);     // H = 1 m, mu = 0.4, e = 1
///     std::cout << impact.fn_peak_N << " N, " << impact.mode << '\n';
///
/// Units are SI, and stand at the end of names. x points along the ground away from O, y upwards;
/// forces act on the tip; times count from touch. Angles do not occur.
///
/// Versions: releases 0.x.y of equal x take each other's place without a new link; one of another x
/// does not, and its library has another SONAME (liboblique.so.0.x). A release of equal x gives the
/// same bits for the same input on every machine, whatever its instruction set, for all but
/// SolverReport::wall_s.
namespace oblique {

using solver::CaseResult;       ///< what solving a point gave
using solver::ErrorEstimate;    ///< estimated errors of outputs
using solver::FallCache;        ///< falls that fingers share
using solver::Finger;           ///< solves points of one model
using solver::InputError;       ///< a value outside its range: message names key, value, range
using solver::Integrator;       ///< how the equations of motion are stepped
using solver::ManyOptions;      ///< of solve_many
using solver::ModelParameters;  ///< the finger, ground and method; the default is `standard`
using solver::ModelPoint;       ///< a point of one of many models
using solver::Outcome;          ///< what became of a point
using solver::Point;            ///< H, mu, e*
using solver::SolveError;       ///< a point that has no answer: message says why
using solver::TraceRow;         ///< one instant of a contact
using solver::Tracing;          ///< what is wanted of the instants, and where they go

using solver::errors_by_companion;  ///< estimated errors of one result
using solver::instruction_set;
using solver::solve_many;

// Parameters by their names, their ranges, and presets: solver/parameters.h.
using solver::find_model_key;
using solver::model_keys;
using solver::preset;
using solver::validate;

/// Version of the library that is linked, as "0.2.0".
inline std::string version() {
  return solver::solver_version();
}

}  // namespace oblique
