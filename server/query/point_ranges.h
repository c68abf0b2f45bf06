#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// Consecutive points, both ends included.
struct PointRange {
  std::uint64_t first;
  std::uint64_t last;

  bool operator==(const PointRange&) const = default;
};

/// Ranges in rising order, disjoint, that contain every point of `recipe` that meets `condition`.
/// They may contain other points. Only comparisons of an axis of a product block, or of `point`,
/// with numbers (=, <, <=, >, >=, BETWEEN) that AND joins are used. A range of an axis is one value
/// wider at each end, because another machine may round a value differently. `condition` must have
/// passed check_sql_part; empty: all points.
std::vector<PointRange> point_ranges(const protocol::Recipe& recipe, std::string_view condition);

/// The range from the first point of `ranges`, which are not empty, to the last.
std::vector<PointRange> hull(const std::vector<PointRange>& ranges);

/// Whether `condition` is `error IS NOT NULL`, or joins this with others by AND. `condition` must
/// have passed check_sql_part.
bool wants_only_failed(std::string_view condition);

/// Number of points of a recipe, filters ignored; 0 if an axis has no value. Throws
/// solver::InputError for a block of more points than a study may have.
std::uint64_t points_of(const protocol::Recipe& recipe);

std::uint64_t points_in(const std::vector<PointRange>& ranges);

}  // namespace oblique::server
