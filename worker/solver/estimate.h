#pragma once

#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"

namespace oblique::solver {

/// The model whose solution of a point is held against that of `model`: half as many elements a
/// link, rounded down (1 stays 1), and twice the steps in contact where these are stable. It costs
/// about a quarter, its fall aside, which depends on the mesh alone.
ModelParameters companion_model(const ModelParameters& model);

/// Estimated errors of `result`, the solution of a point of `model`, from its differences d to
/// `companion`, that of the same point of `companion_model(model)`:
/// error = d (1 + (2 l/L)^4)/(r^p - 1), with r the ratio of the meshes, l the length of an element
/// of the companion, L the length of the bending waves that the contact makes, and p an order for
/// each output (README.md, "Errors of single results"). Dimensionless: of forces and impulses
/// relative to the normal one, of times to the duration, of the slide to speed at touch times
/// duration, of speeds to the speed at touch. Absent where that is 0.
ErrorEstimate estimated_errors(const ModelParameters& model, const CaseResult& result,
                               const CaseResult& companion);

}  // namespace oblique::solver
