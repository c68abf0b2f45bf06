#include "client/plot/cell_areas.h"

#include <algorithm>
#include <utility>

namespace oblique::client::plot {
namespace {

/// Numbers all cells that are connected with `first`.
void fill_area(const std::vector<int>& categories, std::size_t columns, std::size_t first,
               std::uint32_t number, std::vector<std::uint32_t>& of_cells) {
  std::vector<std::size_t> open{first};
  of_cells[first] = number;
  const auto visit = [&](std::size_t cell) {
    if (of_cells[cell] == CellAreas::kNone && categories[cell] == categories[first]) {
      of_cells[cell] = number;
      open.push_back(cell);
    }
  };
  while (!open.empty()) {
    const std::size_t cell = open.back();
    open.pop_back();
    if (cell % columns != 0) {
      visit(cell - 1);
    }
    if (cell % columns + 1 != columns) {
      visit(cell + 1);
    }
    if (cell >= columns) {
      visit(cell - columns);
    }
    if (cell + columns < categories.size()) {
      visit(cell + columns);
    }
  }
}

/// Finds the largest square in each area: that which ends in a cell is one larger than the smallest
/// of those that end beside and below it.
void find_squares(std::size_t columns, CellAreas& found) {
  std::vector<std::size_t> below(columns, 0);
  std::vector<std::size_t> sides(columns, 0);
  for (std::size_t cell = 0; cell < found.of_cells.size(); ++cell) {
    const std::size_t x = cell % columns;
    if (x == 0) {
      std::swap(below, sides);
    }
    const auto area = found.of_cells[cell];
    const bool goes_on = x > 0 && cell >= columns && found.of_cells[cell - 1] == area &&
                         found.of_cells[cell - columns] == area &&
                         found.of_cells[cell - columns - 1] == area;
    sides[x] = goes_on ? 1 + std::min({sides[x - 1], below[x], below[x - 1]}) : 1;
    if (area != CellAreas::kNone && sides[x] > found.areas[area].side) {
      const double half = static_cast<double>(sides[x]) / 2.0;
      const std::size_t row = cell / columns;
      found.areas[area].side = sides[x];
      found.areas[area].x = static_cast<double>(x + 1) - half;
      found.areas[area].y = static_cast<double>(row + 1) - half;
    }
  }
}

}  // namespace

CellAreas areas_of(const std::vector<int>& categories, std::size_t columns) {
  CellAreas found;
  found.of_cells.assign(categories.size(), CellAreas::kNone);
  for (std::size_t cell = 0; cell < categories.size(); ++cell) {
    if (categories[cell] >= 0 && found.of_cells[cell] == CellAreas::kNone) {
      fill_area(categories, columns, cell, static_cast<std::uint32_t>(found.areas.size()),
                found.of_cells);
      found.areas.push_back({.category = categories[cell]});
    }
  }
  find_squares(columns, found);
  return found;
}

}  // namespace oblique::client::plot
