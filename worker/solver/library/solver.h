#pragma once

#include <string>

#include "worker/solver/estimate.h"
#include "worker/solver/solve.h"
#include "worker/solver/solve_many.h"

/// The oblique impact of a flexible robotic finger on rough ground, as a library.
///
/// A chain of slender elastic links falls from rest, straight and level. Its tip strikes rough
/// ground at a drop H below the pin O, and contact springs with friction and losses act until it
/// leaves the ground. Equations 1 to 25 of the paper "Oblique impact for flexible robotic finger
/// system", as corrected in worker/solver/README.md of the sources.
///
///     #include <oblique/solver.h>
///     const oblique::Finger finger;                        // the preset `standard`
///     const auto impact = finger.solve(1.0, 0.4, 1.0);     // H = 1 m, mu = 0.4, e = 1
///     std::cout << impact.fn_peak_N << " N, " << impact.mode << '\n';
///
/// Units are SI; names end with them. x points along the ground away from O, y upwards. Forces act
/// on the tip. Times count from touch.
///
/// Releases 0.x.y with the same x replace each other without relinking and give the same results.
namespace oblique {

using solver::CaseResult;       ///< outputs of a point
using solver::ErrorEstimate;    ///< estimated errors of outputs
using solver::FallCache;        ///< falls that fingers share
using solver::Finger;           ///< solves points of one model
using solver::InputError;       ///< a value outside its range; names key, value and range
using solver::Integrator;       ///< how the equations of motion are stepped
using solver::ManyOptions;      ///< options of solve_many
using solver::ModelParameters;  ///< finger, ground and method; by default the preset `standard`
using solver::ModelPoint;       ///< a point of one of many models
using solver::Outcome;          ///< result or error of a point
using solver::Point;            ///< H, mu, e*
using solver::SolveError;       ///< why a point has no answer
using solver::TraceRow;         ///< one instant of a contact
using solver::Tracing;          ///< receives the instants of a contact

using solver::errors_by_companion;  ///< estimated errors of one result
using solver::instruction_set;
using solver::solve_many;

// Names and ranges of parameters, and presets: solver/parameters.h.
using solver::find_model_key;
using solver::model_keys;
using solver::preset;
using solver::validate;

/// Version of the linked library, as "0.2.0".
inline std::string version() {
  return solver::solver_version();
}

}  // namespace oblique
