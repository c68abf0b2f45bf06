#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>

#include "client/explore/fit.h"
#include "client/paper/paper_comparison.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// Model keys that the paper does not print, or prints rounded, and that are fitted.
inline constexpr std::array<std::string_view, 4> kFittedKeys{"A", "I", "k", "eta2"};

/// Fits kFittedKeys, from a third to three times the values of `start`, so that the sum of squared
/// relative differences from the published numbers is least (`minimise`). A number that the model
/// lacks counts as 0. Returns the minimum with its residuals in percent. `before_each` is called
/// with the description of each trial. Throws solver::SolveError when no minimum is found or a
/// model on the way cannot be solved.
FitStep fit_paper(const PublishedTable& published, const solver::ModelParameters& start,
                  const std::function<void(const std::string& what)>& before_each);

}  // namespace oblique::client
