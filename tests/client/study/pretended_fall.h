#pragma once

#include <numeric>

#include "client/study/reach.h"

namespace oblique::client {

/// Invented largest drop: a fixed share of the length, as the paper's finger: 1.179156 m of 1.2 m.
inline double pretended_drop_m(const solver::ModelParameters& model) {
  return 0.98263 * std::accumulate(model.lengths_m.begin(), model.lengths_m.end(), 0.0);
}

inline ReachCheck pretended_reach() {
  return ReachChecker(pretended_drop_m);
}

}  // namespace oblique::client
