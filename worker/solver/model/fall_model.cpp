#include "worker/solver/model/fall_model.h"

#include <algorithm>
#include <bit>

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

bool changes_fall(const ParameterKey& key, const ModelParameters& model) {
  ModelParameters one = model;
  ModelParameters other = model;
  key.set(one, 1.0);  // no key takes these two values for one
  key.set(other, 2.0);
  return !(fall_model(one) == fall_model(other));
}

std::uint64_t fall_hash(const ModelParameters& model) {
  constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15;  // 2^64 over the golden ratio
  const ModelParameters falling = fall_model(model);
  std::uint64_t hash = 0;
  const auto add = [&hash](double value) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * kOdd;
    hash ^= hash >> 32;
  };
  std::for_each(falling.lengths_m.begin(), falling.lengths_m.end(), add);
  for (const auto& key : model_keys()) {
    add(key.get(falling));
  }
  add(falling.step_factor);
  return hash;
}

}  // namespace oblique::solver
