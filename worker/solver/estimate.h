#pragma once

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::solver {

/// `model` with half as many elements a link, rounded down (1 stays 1), and steps in contact twice
/// as long, where these are stable. Solving it takes about a quarter of the time, besides its fall.
ModelParameters companion_model(const ModelParameters& model);

/// Estimated errors of `result`, a point of `model`, from its differences to `companion`, the same
/// point of `companion_model(model)` (accuracy.md, "Errors of single results"). Forces and impulses
/// are relative to the normal ones, times to the duration, the slide to speed at touch times
/// duration, speeds to the speed at touch. Absent where this scale is 0.
ErrorEstimate estimated_errors(const ModelParameters& model, const CaseResult& result,
                               const CaseResult& companion);

/// The same, but solves the companion, with a fall from `falls`. Empty if there is no coarser mesh
/// or the companion has no answer.
ErrorEstimate errors_by_companion(const ModelParameters& model, const CaseResult& result,
                                  FallCache& falls);

/// Like solve_points(), with estimated errors in each result whose companion has an answer. Solves
/// up to 256 points, or points of one second, before their companions; outcomes follow in bursts.
void solve_points_with_errors(const FingerPoints& source, FallCache& falls,
                              const TakeOutcome& sink);

}  // namespace oblique::solver
