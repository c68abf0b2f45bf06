#pragma once

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::solver {

/// `model` with half as many elements a link, rounded down (1 stays 1), and steps in contact twice
/// as long, where these are stable. Without its fall, solving it takes about a quarter of the time.
ModelParameters companion_model(const ModelParameters& model);

/// Estimates the errors of `result`, the result of a point of `model`, from its differences to
/// `companion`, the result of the same point of `companion_model(model)` (accuracy.md, "Errors of
/// single results"). Errors of forces are relative to the largest normal force, of impulses to the
/// normal impulse, of times to the duration, of the slide to the slide, and of speeds to the speed
/// at touch. An error is absent if its scale is 0.
ErrorEstimate estimated_errors(const ModelParameters& model, const CaseResult& result,
                               const CaseResult& companion);

/// Like estimated_errors(), but solves the companion, with a fall from `falls`. The estimate is
/// empty if there is no coarser mesh or the companion fails.
ErrorEstimate errors_by_companion(const ModelParameters& model, const CaseResult& result,
                                  FallCache& falls);

/// Like solve_points(), but adds estimated errors to each result whose companion is solved. Solves
/// points for at most one second, at most 256, and then their companions. So outcomes come in
/// bursts.
void solve_points_with_errors(const FingerPoints& source, FallCache& falls,
                              const TakeOutcome& sink);

}  // namespace oblique::solver
