#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "proto/recipe/point_table.h"
#include "server/web/answers/fields.h"

namespace oblique::server {

/// One side of a slice: which values of an axis are shown.
struct GridSide {
  std::string key;
  std::uint64_t of = 1;     ///< values of the axis
  std::uint64_t first = 0;  ///< of those that are looked at
  std::uint64_t last = 0;
  std::uint64_t stride = 0;            ///< from one value to the next, in points
  std::vector<std::uint64_t> numbers;  ///< of the values that are shown, rising
  std::vector<double> values;          ///< the same
};

/// An axis that is held at one value.
struct GridPlace {
  std::string key;
  std::uint64_t of;
  std::uint64_t number;
  double value;
};

/// A plane, or a line, through the points of a block whose axes multiply.
struct GridSlice {
  std::size_t block;
  GridSide x;
  GridSide y;  ///< without a key: one row
  std::vector<GridPlace> at;
  std::uint64_t first_point;  ///< that of the first values of both sides

  /// The point of a cell.
  std::uint64_t point(std::size_t column, std::size_t row) const {
    return first_point + x.numbers[column] * x.stride + (y.numbers[row] * y.stride);
  }
};

/// What `x`, `y`, `at`, `block`, `x0`, `x1`, `y0`, `y1`, `nx` and `ny` ask for. Throws
/// std::invalid_argument naming the field and what is allowed.
GridSlice grid_slice(const protocol::PointTable& table, const FieldReader& fields);

/// What `at` holds fixed, and only that, of the first block that has all its axes. Throws as
/// `grid_slice` does.
std::vector<GridPlace> grid_places(const protocol::PointTable& table, const FieldReader& fields);

}  // namespace oblique::server
