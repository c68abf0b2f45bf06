#pragma once

#include <string>
#include <utility>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/model_message.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// A model in which no parameter has its default value.
inline solver::ModelParameters unusual_model() {
  solver::ModelParameters model = solver::preset("paper");
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

/// An axis of `count` evenly spaced values from `from` to `to` inclusive.
inline Axis range(const std::string& key, double from, double to, std::uint64_t count) {
  Axis axis;
  axis.set_key(key);
  axis.set_from(from);
  axis.set_to(to);
  axis.set_count(count);
  return axis;
}

/// An axis of `count` values from `from` to `to` inclusive, with equal ratios of neighbours.
inline Axis log_range(const std::string& key, double from, double to, std::uint64_t count) {
  Axis axis = range(key, from, to, count);
  axis.set_spacing(SPACING_LOGARITHMIC);
  return axis;
}

/// An axis whose value is an expression of other axes.
inline Axis following(const std::string& key, const std::string& expression) {
  Axis axis;
  axis.set_key(key);
  axis.set_expression(expression);
  return axis;
}

/// An axis of a sample, uniformly distributed between `from` and `to`.
inline Axis uniform(const std::string& key, double from, double to) {
  Axis axis;
  axis.set_key(key);
  axis.mutable_distribution()->set_from(from);
  axis.mutable_distribution()->set_to(to);
  return axis;
}

/// A block that is a grid of `axes`, filtered by `where`.
inline Block filtered(const std::vector<Axis>& axes, const std::string& where) {
  Block block;
  for (const Axis& axis : axes) {
    *block.add_axes() = axis;
  }
  block.set_where(where);
  return block;
}

/// A block that pairs the values of its axes (zip).
inline Block zipped(const std::vector<Axis>& axes) {
  Block block = filtered(axes, "");
  block.set_zip(true);
  return block;
}

inline Sample sample_of(SampleKind kind, std::uint64_t count, std::uint64_t seed = 1) {
  Sample sample;
  sample.set_kind(kind);
  sample.set_count(count);
  sample.set_seed(seed);
  return sample;
}

/// A block that is a sample of `count` points.
inline Block sampled(const std::vector<Axis>& axes, SampleKind kind, std::uint64_t count,
                     std::uint64_t seed = 1) {
  Block block = filtered(axes, "");
  *block.mutable_sample() = sample_of(kind, count, seed);
  return block;
}

/// A recipe of the given blocks and the preset `paper`.
inline Recipe recipe_of_blocks(const std::vector<Block>& blocks) {
  Recipe recipe;
  *recipe.mutable_model() = to_message(solver::preset("paper"));
  for (const Block& block : blocks) {
    *recipe.add_blocks() = block;
  }
  return recipe;
}

/// A sample that needs `falls` falls: E has `falls` values, and each point has a random k.
inline Recipe sample_with_falls(std::uint64_t points, std::uint64_t falls,
                                SampleKind kind = SAMPLE_RANDOM) {
  return recipe_of_blocks(
      {sampled({range("E", 6e10, 7e10, falls), uniform("k", 1e7, 3e7), listed("H", {1.0}),
                uniform("mu", 0.0, 1.0), listed("e", {1.0})},
               kind, points)});
}

/// A recipe of the given blocks, each a list of axes, and the preset `paper`.
inline Recipe recipe_of(const std::vector<std::vector<Axis>>& blocks) {
  Recipe recipe = recipe_of_blocks({});
  for (const auto& axes : blocks) {
    Block& block = *recipe.add_blocks();
    for (const Axis& axis : axes) {
      *block.add_axes() = axis;
    }
  }
  return recipe;
}

}  // namespace oblique::protocol
