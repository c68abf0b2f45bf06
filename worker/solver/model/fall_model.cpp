#include "worker/solver/model/fall_model.h"

#include <algorithm>

namespace oblique::solver {

ModelParameters fall_model(const ModelParameters& model) {
  const ModelParameters defaults;
  ModelParameters falling = model;
  falling.k_N_m = defaults.k_N_m;
  falling.eta2 = defaults.eta2;
  falling.dt_s = defaults.dt_s;
  falling.step_factor = defaults.step_factor;
  falling.tolerance = std::min(falling.tolerance, defaults.tolerance);
  if (falling.integrator != Integrator::kGeneralizedAlpha) {
    falling.spectral_radius = defaults.spectral_radius;
  }
  return falling;
}

}  // namespace oblique::solver
