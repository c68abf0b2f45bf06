#pragma once

#include <string>
#include <utility>
#include <vector>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// A model in which no parameter has its default.
inline solver::ModelParameters unusual_model() {
  solver::ModelParameters model;
  model.lengths_m = {0.5, 0.25};
  model.E_Pa = 1e9;
  model.A_m2 = 2e-4;
  model.I_m4 = 3e-8;
  model.rho_kg_m3 = 1000.0;
  model.g_m_s2 = 1.62;
  model.elements_per_link = 7;
  model.k_N_m = 5e6;
  model.eta2 = 1.5;
  model.tip_mass_kg = 0.125;
  model.integrator = solver::Integrator::kGeneralizedAlpha;
  model.spectral_radius = 0.5;
  model.dt_s = 1e-6;
  model.dt_fall_s = 2e-6;
  model.tolerance = 1e-6;
  return model;
}

/// An axis with listed values.
inline Axis listed(const std::string& key, const std::vector<double>& values) {
  Axis axis;
  axis.set_key(key);
  axis.mutable_values()->Assign(values.begin(), values.end());
  return axis;
}

/// An axis of `count` values with both ends in.
inline Axis range(const std::string& key, double from, double to, std::uint64_t count) {
  Axis axis;
  axis.set_key(key);
  axis.set_from(from);
  axis.set_to(to);
  axis.set_count(count);
  return axis;
}

/// A recipe of the given blocks, each a list of axes, without a model.
inline Recipe recipe_of(const std::vector<std::vector<Axis>>& blocks) {
  Recipe recipe;
  for (const auto& axes : blocks) {
    Block& block = *recipe.add_blocks();
    for (const Axis& axis : axes) {
      *block.add_axes() = axis;
    }
  }
  return recipe;
}

}  // namespace oblique::protocol
