#pragma once

#include <numeric>

#include "client/study/reach.h"

namespace oblique::client {

/// Returns an invented largest drop: 0.98263 of the finger's length, about as in the paper.
inline double fake_drop_m(const solver::ModelParameters& model) {
  return 0.98263 * std::accumulate(model.lengths_m.begin(), model.lengths_m.end(), 0.0);
}

inline ReachCheck fake_reach() {
  return ReachChecker(fake_drop_m);
}

}  // namespace oblique::client
