#include "client/plot/cell_areas.h"

#include <algorithm>

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

/// Finds the rectangle with the longest shorter side in each area. Row by row, each column of cells
/// of one area that ends in the row is a bar; the largest rectangle over neighbouring bars is found
/// when a lower bar follows.
class RectangleSearch {
 public:
  RectangleSearch(std::size_t columns, double cell_width, double cell_height, CellAreas& found)
      : columns_(columns), width_(cell_width), height_(cell_height), found_(found) {}

  void run() {
    std::vector<std::size_t> bars(columns_, 0);
    for (std::size_t row = 0; row * columns_ < found_.of_cells.size(); ++row) {
      for (std::size_t x = 0; x < columns_; ++x) {
        const std::size_t cell = row * columns_ + x;
        const bool goes_on = row > 0 && found_.of_cells[cell - columns_] == found_.of_cells[cell];
        bars[x] = goes_on ? bars[x] + 1 : 1;
        if (x > 0 && found_.of_cells[cell - 1] != found_.of_cells[cell]) {
          close(row, x, 0);
        }
        const std::size_t begin = close(row, x, bars[x]);
        open_.push_back({begin, bars[x]});
      }
      close(row, columns_, 0);
    }
  }

 private:
  struct Bars {
    std::size_t begin;   ///< first column
    std::size_t height;  ///< of all from there on
  };

  /// Ends rectangles that are higher than `height` before column `x`. Returns where one of that
  /// height begins.
  std::size_t close(std::size_t row, std::size_t x, std::size_t height) {
    std::size_t begin = x;
    while (!open_.empty() && open_.back().height >= height) {
      begin = open_.back().begin;
      note(row, begin, x, open_.back().height);
      open_.pop_back();
    }
    return begin;
  }

  void note(std::size_t row, std::size_t begin, std::size_t end, std::size_t height) {
    const std::uint32_t number = found_.of_cells[row * columns_ + begin];
    const auto cells = static_cast<double>(end - begin);
    const auto rows = static_cast<double>(height);
    const double room = std::min(cells * width_, rows * height_);
    if (number != CellAreas::kNone && room > found_.areas[number].room) {
      CellArea& area = found_.areas[number];
      area.room = room;
      area.x = static_cast<double>(begin) + cells / 2.0;
      area.y = static_cast<double>(row + 1) - rows / 2.0;
    }
  }

  const std::size_t columns_;
  const double width_;
  const double height_;
  CellAreas& found_;
  std::vector<Bars> open_;  ///< rising in height
};

}  // namespace

CellAreas areas_of(const std::vector<int>& categories, std::size_t columns, double cell_width,
                   double cell_height) {
  CellAreas found;
  found.of_cells.assign(categories.size(), CellAreas::kNone);
  for (std::size_t cell = 0; cell < categories.size(); ++cell) {
    if (categories[cell] >= 0 && found.of_cells[cell] == CellAreas::kNone) {
      fill_area(categories, columns, cell, static_cast<std::uint32_t>(found.areas.size()),
                found.of_cells);
      found.areas.push_back({.category = categories[cell]});
    }
  }
  RectangleSearch(columns, cell_width, cell_height, found).run();
  return found;
}

}  // namespace oblique::client::plot
