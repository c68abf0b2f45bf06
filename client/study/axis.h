#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/recipe.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// A study as people write it: a name and what makes its points.
struct Study {
  std::string name;
  protocol::Recipe recipe;
};

/// The model or point key called `name`. Throws InputError for an unknown one, with the nearest
/// and the list of all.
const solver::ParameterKey& axis_key(std::string_view name);

/// A number of plain text; nothing for what is not one number from end to end.
std::optional<double> parsed_number(std::string_view text);

/// Axes from what users wrote. Each throws InputError naming key, value and what is allowed.
protocol::Axis listed_axis(const solver::ParameterKey& key, const std::vector<double>& values);
/// `count` values with both ends in.
protocol::Axis counted_axis(const solver::ParameterKey& key, double from, double to,
                            std::int64_t count);
/// Values `step` apart, of which the last is `to`.
protocol::Axis stepped_axis(const solver::ParameterKey& key, double from, double to, double step);

/// Puts the axes into the order that recipes need: model keys as listings have them, then H, mu, e.
/// Throws InputError when H, mu or e is missing.
protocol::Block block_of(std::vector<protocol::Axis> axes);

/// Throws InputError unless `name` may name a study; proto/recipe/study_name.h says what may.
void check_study_name(const std::string& name);

}  // namespace oblique::client
