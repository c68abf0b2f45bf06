#pragma once

#include <cstdint>
#include <optional>

#include "proto/recipe/point_table.h"
#include "server/scheduler/points/interval_set.h"

namespace oblique::server {

/// How many points somebody wants under one lease. Points of one model share a fall, and models are
/// solved side by side.
struct Portion {
  std::uint64_t points;           ///< about so many: it ends with a model where one ends near there
  std::uint64_t models = 1;       ///< at least so many models, as far as `most_points` has room
  std::uint64_t most_points = 0;  ///< for a whole model more, or for `models`; 0: `points`
  /// Where the last batch ended that the same worker got: what is left of that batch's last model,
  /// whose fall it has, comes first.
  std::optional<std::uint64_t> follows{};
};

/// Where the batch that begins with `free` ends. It has a point at least, and one at most when one
/// is wanted.
std::uint64_t end_of_batch(const protocol::PointTable& table, const Interval& free,
                           const Portion& wanted);

/// The end of the run of points that share the model of the point before `end`.
std::uint64_t end_of_model(const protocol::PointTable& table, std::uint64_t end);

}  // namespace oblique::server
