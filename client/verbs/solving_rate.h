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
  /// Elements a link on which they were solved where the study's own mesh costs too much to try;
  /// the times are then extrapolated to that. 0: on the study's own.
  int elements_per_link = 0;

  /// How long so many points with so many falls would take here.
  double time_s(std::uint64_t all_points, std::uint64_t all_falls) const;
};

/// Solves points from all over the study for about `budget_s`, or all of a small one, on a thread a
/// core. Of a mesh of more than 48 elements in all, a coarser one and one of half its elements are
/// solved instead, and the costs extrapolated by the power that they show. What is begun is
/// finished: a fall and a few points a thread at least.
SolvingRate measured_rate(const std::shared_ptr<const protocol::PointTable>& points,
                          double budget_s);

}  // namespace oblique::client
