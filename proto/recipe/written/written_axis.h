#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "worker/solver/model/parameters.h"

// Axes of what people wrote. Each throws InputError naming key, value and what is allowed.
namespace oblique::protocol {

/// Of a block of that kind: side by side a value may come twice.
Axis listed_axis(const solver::ParameterKey& key, const std::vector<double>& values,
                 BlockKind kind = BlockKind::kProduct);

/// `count` values with both ends in.
Axis counted_axis(const solver::ParameterKey& key, double from, double to, std::int64_t count,
                  Spacing spacing = SPACING_LINEAR);

/// Values `step` apart, of which the last is `to`.
Axis stepped_axis(const solver::ParameterKey& key, double from, double to, double step);

/// Says of what was written as a count that it is none.
[[noreturn]] void throw_wrong_count(const solver::ParameterKey& key, std::string_view written);

}  // namespace oblique::protocol
