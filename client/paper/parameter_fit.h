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

/// Where a fit stands.
struct FitStep {
  int iteration;                        ///< 0: the start
  solver::ModelParameters model;        ///< with the fitted parameters of this iteration
  std::vector<Difference> differences;  ///< from every published number
  DifferenceSummary summary;
};

/// Fits the parameters of kFittedKeys, from where `start` has them, so that the sum of squared
/// relative differences from all published numbers is least (Levenberg-Marquardt on the logarithms
/// of the parameters, derivatives by differences). A published peak, phase or stick that the model
/// lacks counts as a difference of 100 %. Stops when an iteration lowers the sum of squares by less
/// than 1e-3 of itself, or moves the parameters by less than 1e-5 of the way from the start.
/// `after_each` is called with the start and after each iteration. Gives the last step. Throws
/// SolveError when no minimum is found within 50 iterations or a model on the way cannot be solved.
FitStep fit_parameters(const PublishedTable& published, const solver::ModelParameters& start,
                       const std::function<void(const FitStep&)>& after_each);

}  // namespace oblique::client
