#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "proto/recipe/point_table.h"

namespace oblique::client {

/// What solving some points of a study took here, with all threads at work.
struct SolvingRate {
  std::size_t threads = 1;
  std::uint64_t points = 0;
  double points_s = 0.0;  ///< of a thread, for all of them, without falls
  std::uint64_t falls = 0;
  double falls_s = 0.0;  ///< of a thread, for all of them

  /// How long so many points with so many falls would take here.
  double time_s(std::uint64_t all_points, std::uint64_t all_falls) const;
};

/// Solves points from all over the study for about `budget_s`, or all of a small one, on a thread a
/// core; at least a few points a thread, however long they take.
SolvingRate measured_rate(const std::shared_ptr<const protocol::PointTable>& points,
                          double budget_s);

}  // namespace oblique::client
