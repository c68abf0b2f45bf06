#pragma once

#include <string>
#include <utility>
#include <vector>

#include "proto/recipe/recipe.h"

namespace oblique::protocol {

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
