#pragma once

#include "worker/solver/solve.h"

namespace oblique::solver {

/// The preset `paper`, shared by all tests of a process because its fall takes half a second.
inline const Finger& paper_finger() {
  static const Finger finger{preset("paper")};
  return finger;
}

/// The preset `paper` with few elements a link, whose fall is fast.
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
