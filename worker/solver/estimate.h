#pragma once

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::solver {

/// The model whose solution of a point is held against that of `model`: half as many elements a
/// link, rounded down (1 stays 1, and has no estimate), and twice the steps in contact where these
/// are stable. It costs about a quarter, its fall aside, which depends on the mesh alone.
ModelParameters companion_model(const ModelParameters& model);

/// Estimated errors of `result`, the solution of a point of `model`, from its differences d to
/// `companion`, that of the same point of `companion_model(model)`:
/// error = d (1 + (2 l/L)^4)/(r^p - 1) + tolerance, with r the ratio of the meshes, l the length of
/// an element of the companion, L the length of the bending waves that the contact makes, p an
/// order for each output, and the tolerance that chooses the step (accuracy.md, "Errors of single
/// results"). Dimensionless: of forces and impulses relative to the normal one, of times to the
/// duration, of the slide to speed at touch times duration, of speeds to the speed at touch. Absent
/// where that is 0.
ErrorEstimate estimated_errors(const ModelParameters& model, const CaseResult& result,
                               const CaseResult& companion);

/// The same of the result of one point, its companion solved here over a fall from
/// `falls`: the bits that solve_points_with_errors() gives it. Empty where there is
/// no coarser mesh, and where the companion has no answer.
ErrorEstimate errors_by_companion(const ModelParameters& model, const CaseResult& result,
                                  FallCache& falls);

/// As solve_points(), and each result has its estimated errors, where its companion has an answer;
/// every other number has the same bits. Some hundred points at a time, of about a second at most,
/// are solved before their companions, whose falls come from `falls`, so outcomes come in
/// bursts.
void solve_points_with_errors(const FingerPoints& source, FallCache& falls,
                              const TakeOutcome& sink);

}  // namespace oblique::solver
