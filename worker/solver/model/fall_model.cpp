#include "worker/solver/model/fall_model.h"

#include <algorithm>
#include <bit>
#include <cstdint>

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

std::uint64_t fall_hash(const ModelParameters& model) {
  const ModelParameters falling = fall_model(model);
  std::uint64_t hash = 0;
  const auto mix = [&hash](double value) {  // as splitmix64
    hash = (hash ^ std::bit_cast<std::uint64_t>(value)) + 0x9e3779b97f4a7c15U;
    hash = (hash ^ (hash >> 30U)) * 0xbf58476d1ce4e5b9U;
    hash = (hash ^ (hash >> 27U)) * 0x94d049bb133111ebU;
    hash ^= hash >> 31U;
  };
  for (const double length_m : falling.lengths_m) {
    mix(length_m);
  }
  for (const ParameterKey& key : model_keys()) {
    mix(key.get(falling));
  }
  return hash;
}

}  // namespace oblique::solver
