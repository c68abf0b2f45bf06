#pragma once

#include <array>
#include <functional>
#include <string_view>
#include <vector>

#include "client/paper/paper_comparison.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// Model keys that the paper does not print, or prints rounded, and that are fitted.
inline constexpr std::array<std::string_view, 4> kFittedKeys{"A", "I", "k", "eta2"};

/// State of a fit to the paper's numbers after an iteration.
struct PaperFitStep {
  int iteration;                        ///< 0: the start
  solver::ModelParameters model;        ///< with the fitted parameters of this iteration
  std::vector<Difference> differences;  ///< from every published number
  DifferenceSummary summary;
};

/// Fits the parameters of kFittedKeys, from a third to three times what `start` has, so that the
/// sum of squared relative differences from all published numbers is least (`minimise`). A
/// published peak, phase or stick that the model lacks counts as a difference of 100 %.
/// `after_each` is called with the start and after each iteration. Returns the last step. Throws
/// SolveError when no minimum is found or a model on the way cannot be solved.
PaperFitStep fit_paper(const PublishedTable& published, const solver::ModelParameters& start,
                       const std::function<void(const PaperFitStep&)>& after_each);

}  // namespace oblique::client
