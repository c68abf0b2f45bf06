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

/// One side of a slice: the values of an axis that are shown.
struct GridSide {
  std::string key;
  std::uint64_t of = 1;     ///< number of values of the axis
  std::uint64_t first = 0;  ///< number of the first value in the selected part
  std::uint64_t last = 0;
  std::uint64_t stride = 0;            ///< difference of point numbers from one value to the next
  std::vector<std::uint64_t> numbers;  ///< numbers of the shown values, rising
  std::vector<double> values;          ///< the shown values
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
  GridSide y;  ///< its key is empty: the slice is a line
  std::vector<GridPlace> at;
  std::uint64_t first_point;  ///< point of the first values of both sides

  /// The point of a cell.
  std::uint64_t point(std::size_t column, std::size_t row) const {
    return first_point + x.numbers[column] * x.stride + (y.numbers[row] * y.stride);
  }
};

/// The slice that the fields `x`, `y`, `at`, `block`, `x0`, `x1`, `y0`, `y1`, `nx` and `ny` select.
/// Throws std::invalid_argument, which names the field and what is allowed.
GridSlice grid_slice(const protocol::PointTable& table, const FieldReader& fields);

/// The axes that the field `at` holds fixed, in the first block that has all of them. Throws as
/// `grid_slice` does.
std::vector<GridPlace> grid_places(const protocol::PointTable& table, const FieldReader& fields);

}  // namespace oblique::server
