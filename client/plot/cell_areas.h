#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace oblique::client::plot {

/// Cells of one category that touch along a side, and the rectangle in them that has most room for
/// a letter.
struct CellArea {
  int category = 0;
  double room = 0.0;  ///< the shorter side of the rectangle, in the unit of the cells' sides
  double x = 0.0;     ///< its middle, in cells from the first
  double y = 0.0;
};

struct CellAreas {
  static constexpr std::uint32_t kNone = UINT32_MAX;
  std::vector<CellArea> areas = {};
  std::vector<std::uint32_t> of_cells = {};  ///< number of its area; kNone: it has no category
};

/// More areas than these cannot be told apart by outlines and hatching.
inline constexpr std::size_t kMostOutlinedAreas = 300;

/// The areas of cells, row by row; a category below 0 is none. All cells are drawn with this width
/// and height.
CellAreas areas_of(const std::vector<int>& categories, std::size_t columns, double cell_width,
                   double cell_height);

}  // namespace oblique::client::plot
