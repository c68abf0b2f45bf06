#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/plot/draw/outline.h"

namespace oblique::client::plot {

/// Cells of one kind that share edges.
struct Area {
  int kind = 0;
  std::size_t cells = 0;
  // The largest square in it: its side, and its middle, in cells.
  double x = 0.0;
  double y = 0.0;
  std::size_t side = 0;
};

struct Areas {
  static constexpr std::uint32_t kNone = UINT32_MAX;

  std::vector<Area> areas = {};              ///< in the order of their first cells
  std::vector<std::uint32_t> of_cells = {};  ///< kNone: of a kind below 0
};
Areas areas_of(const KindGrid& grid);

/// The grid without areas of fewer than `least` cells. Where such cells lie inside an area, that
/// goes on over them; else they are of kind -1.
KindGrid without_specks(const KindGrid& grid, std::size_t least);

/// The smallest `least` for which outlines of what `without_specks` leaves have few enough corners
/// to be followed by eyes, and to be written as paths: 1 if all may stay. 0: there is none, as the
/// kinds change from cell to cell.
std::size_t least_outlined(const KindGrid& grid);

}  // namespace oblique::client::plot
