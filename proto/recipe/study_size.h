#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/recipe/point_table.h"

namespace oblique::protocol {

/// The size of a study.
struct StudySize {
  std::uint64_t points;   ///< points that filters keep
  bool points_estimated;  ///< `points` is estimated from random points
  std::uint64_t models;
  std::uint64_t falls;   ///< different falls
  bool falls_estimated;  ///< from 10^4 random points, because the study has more than 10^5
  std::uint64_t bytes;   ///< size in a database
  std::vector<std::uint64_t> examples;  ///< numbers of up to 64 random points
};
StudySize size_of(const PointTable& table);

/// Number of points that a filter keeps.
struct PointsLeftIn {
  std::uint64_t points;
  bool estimated;
};
/// For a block of the recipe: counted up to 10^5 points, else estimated from 10^4 random points.
PointsLeftIn points_left_in(const PointTable& table, std::size_t block);

}  // namespace oblique::protocol
