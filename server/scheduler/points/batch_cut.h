#pragma once

#include <cstdint>
#include <optional>

#include "proto/recipe/point_table.h"
#include "server/scheduler/points/point_order.h"
#include "server/study/interval_set.h"

namespace oblique::server {

/// How many points a worker wants under one lease.
struct Portion {
  std::uint64_t points;           ///< about as many: the batch ends with a group if one ends near
  std::uint64_t groups = 1;       ///< at least as many groups, if `most_points` has room for them
  std::uint64_t most_points = 0;  ///< limit for one whole group more, or for `groups`; 0: `points`
  /// Falls that the worker solves side by side: the size of groups if the study is arranged now. 0:
  /// it must not be, for leases are of places.
  std::uint64_t falls = 0;
  /// The place at which the worker's last batch ended. The rest of that batch's last group, whose
  /// falls the worker has solved, comes first.
  std::optional<std::uint64_t> follows{};
};

/// The place at which the batch that begins with the places `free` ends. A batch has one point at
/// least, and one at most when one is wanted.
std::uint64_t end_of_batch(const protocol::PointTable& table, const PointOrder& order,
                           const Interval& free, const Portion& wanted);

}  // namespace oblique::server
