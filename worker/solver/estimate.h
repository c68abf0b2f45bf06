#pragma once

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::solver {

/// The model whose results are compared with those of `model`: half as many elements a link,
/// rounded down (1 stays 1 and has no estimate), and steps in contact twice as long, where these
/// are stable. It takes about a quarter of the time, apart from its own fall.
ModelParameters companion_model(const ModelParameters& model);

/// Estimated errors of `result`, a point of `model`, from its differences to `companion`, the same
/// point of `companion_model(model)` (accuracy.md, "Errors of single results"). Dimensionless: of
/// forces and impulses relative to the normal one, of times to the duration, of the slide to speed
/// at touch times duration, of speeds to the speed at touch. Absent where that is 0.
ErrorEstimate estimated_errors(const ModelParameters& model, const CaseResult& result,
                               const CaseResult& companion);

/// The same for one point: its companion is solved here, with a fall from `falls`. Gives the same
/// bits as solve_points_with_errors(). Empty if there is no coarser mesh or the companion has no
/// answer.
ErrorEstimate errors_by_companion(const ModelParameters& model, const CaseResult& result,
                                  FallCache& falls);

/// Like solve_points(), with estimated errors in each result whose companion has an answer. Solves
/// up to 256 points, for about a second, before their companions, so outcomes come in bursts.
void solve_points_with_errors(const FingerPoints& source, FallCache& falls,
                              const TakeOutcome& sink);

}  // namespace oblique::solver
