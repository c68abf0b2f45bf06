#pragma once

#include "worker/solver/solve.h"

namespace oblique::solver {

/// The finger of the preset `paper`. All tests share it, because its fall takes half a second.
inline const Finger& paper_finger() {
  static const Finger finger{preset("paper")};
  return finger;
}

/// Returns the preset `paper` with few elements per link, so that its fall is solved fast.
inline ModelParameters coarse_model(int elements_per_link = 1) {
  ModelParameters model = preset("paper");
  model.elements_per_link = elements_per_link;
  return model;
}

inline const Finger& coarse_finger() {
  static const Finger finger{coarse_model()};
  return finger;
}

}  // namespace oblique::solver
