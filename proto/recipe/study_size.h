#pragma once

#include <cstdint>
#include <vector>

#include "proto/recipe/point_table.h"

namespace oblique::protocol {

/// How much a study is.
struct StudySize {
  std::uint64_t points;  ///< that filters leave in
  std::uint64_t models;
  std::uint64_t falls;                  ///< different ones
  bool falls_estimated;                 ///< from 10^4 random points: the study has more than 10^5
  std::uint64_t bytes;                  ///< in a database
  std::vector<std::uint64_t> examples;  ///< numbers of up to 64 points, at random
};
/// Its filters should have been counted (PointTable::survey).
StudySize size_of(const PointTable& table);

}  // namespace oblique::protocol
