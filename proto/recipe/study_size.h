#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/recipe/point_table.h"

namespace oblique::protocol {

/// How much a study is.
struct StudySize {
  std::uint64_t points;   ///< that filters leave in
  bool points_estimated;  ///< from points at random
  std::uint64_t models;
  std::uint64_t falls;                  ///< different ones
  bool falls_estimated;                 ///< from 10^4 random points: the study has more than 10^5
  std::uint64_t bytes;                  ///< in a database
  std::vector<std::uint64_t> examples;  ///< numbers of up to 64 points, at random
};
StudySize size_of(const PointTable& table);

/// Points that a filter leaves in.
struct PointsLeftIn {
  std::uint64_t points;
  bool estimated;
};
/// Of a block of the recipe. Counted up to 10^5 points, else estimated from 10^4 at random.
PointsLeftIn points_left_in(const PointTable& table, std::size_t block);

}  // namespace oblique::protocol
