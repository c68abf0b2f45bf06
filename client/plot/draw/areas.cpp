#include "client/plot/draw/areas.h"

#include <algorithm>
#include <utility>

namespace oblique::client::plot {
namespace {

/// Cells that are joined, each by the lowest number among them.
class Joined {
 public:
  explicit Joined(std::size_t cells) : above_(cells) {
    for (std::size_t i = 0; i < cells; ++i) {
      above_[i] = static_cast<std::uint32_t>(i);
    }
  }
  std::uint32_t lowest(std::size_t cell) {
    while (above_[cell] != cell) {
      above_[cell] = above_[above_[cell]];
      cell = above_[cell];
    }
    return static_cast<std::uint32_t>(cell);
  }
  void join(std::size_t one, std::size_t other) {
    const auto a = lowest(one);
    const auto b = lowest(other);
    above_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> above_;
};

void number_areas(const KindGrid& grid, Areas& found) {
  const std::size_t columns = grid.columns;
  Joined joined(grid.kinds.size());
  for (std::size_t cell = 0; cell < grid.kinds.size(); ++cell) {
    if (cell % columns != 0 && grid.kinds[cell] == grid.kinds[cell - 1]) {
      joined.join(cell, cell - 1);
    }
    if (cell >= columns && grid.kinds[cell] == grid.kinds[cell - columns]) {
      joined.join(cell, cell - columns);
    }
  }
  found.of_cells.assign(grid.kinds.size(), Areas::kNone);
  for (std::size_t cell = 0; cell < grid.kinds.size(); ++cell) {
    if (grid.kinds[cell] < 0) {
      continue;
    }
    const auto lowest = joined.lowest(cell);
    if (lowest == cell) {
      found.of_cells[cell] = static_cast<std::uint32_t>(found.areas.size());
      found.areas.push_back({.kind = grid.kinds[cell]});
    }
    found.of_cells[cell] = found.of_cells[lowest];
    ++found.areas[found.of_cells[cell]].cells;
  }
}

void measure_rooms(const KindGrid& grid, Areas& found) {
  // Side of the largest square of an area that ends in each cell, from those beside and above.
  std::vector<std::size_t> above(grid.columns, 0);
  std::vector<std::size_t> sides(grid.columns, 0);
  for (std::size_t y = 0; y < grid.rows; ++y) {
    for (std::size_t x = 0; x < grid.columns; ++x) {
      const std::size_t cell = y * grid.columns + x;
      const auto area = found.of_cells[cell];
      const bool has_all = area != Areas::kNone && x > 0 && y > 0 &&
                           found.of_cells[cell - 1] == area &&
                           found.of_cells[cell - grid.columns] == area &&
                           found.of_cells[cell - grid.columns - 1] == area;
      sides[x] = has_all ? 1 + std::min({sides[x - 1], above[x], above[x - 1]}) : 1;
      if (area != Areas::kNone && sides[x] > found.areas[area].side) {
        const double half = static_cast<double>(sides[x]) / 2.0;
        found.areas[area].side = sides[x];
        found.areas[area].x = static_cast<double>(x + 1) - half;
        found.areas[area].y = static_cast<double>(y + 1) - half;
      }
    }
    std::swap(above, sides);
  }
}

/// Where outlines turn: four cells meet that are not two and two, side by side.
std::size_t turns_in(const KindGrid& grid) {
  std::size_t turns = 0;
  for (std::size_t y = 1; y < grid.rows; ++y) {
    for (std::size_t x = 1; x < grid.columns; ++x) {
      const int a = grid.at(x - 1, y - 1);
      const int b = grid.at(x, y - 1);
      const int c = grid.at(x - 1, y);
      const int d = grid.at(x, y);
      turns += (a == b && c == d) || (a == c && b == d) ? 0U : 1U;
    }
  }
  return turns;
}

std::size_t cells_with_kind(const KindGrid& grid) {
  return static_cast<std::size_t>(
      std::count_if(grid.kinds.begin(), grid.kinds.end(), [](int kind) { return kind >= 0; }));
}

}  // namespace

Areas areas_of(const KindGrid& grid) {
  Areas found;
  number_areas(grid, found);
  measure_rooms(grid, found);
  return found;
}

KindGrid without_specks(const KindGrid& grid, std::size_t least) {
  Areas found;
  number_areas(grid, found);
  KindGrid left = grid;
  for (std::size_t y = 0; y < grid.rows; ++y) {
    const std::size_t row = y * grid.columns;
    const auto is_speck = [&](std::size_t x) {
      const auto area = found.of_cells[row + x];
      return area != Areas::kNone && found.areas[area].cells < least;
    };
    for (std::size_t x = 0; x < grid.columns; ++x) {
      const std::size_t begin = x;
      while (x < grid.columns && is_speck(x)) {
        ++x;
      }
      if (x == begin) {
        continue;
      }
      // Inside one area, or between one and the border.
      const int before = begin > 0 ? grid.at(begin - 1, y) : x < grid.columns ? grid.at(x, y) : -1;
      const int behind = x < grid.columns ? grid.at(x, y) : before;
      const int kind = before == behind && x - begin <= least ? before : -1;
      std::fill_n(left.kinds.begin() + static_cast<std::ptrdiff_t>(row + begin), x - begin, kind);
    }
  }
  return left;
}

std::size_t least_outlined(const KindGrid& grid) {
  constexpr std::size_t kTurnsEach = 5;
  const std::size_t most = kTurnsEach * (grid.columns + grid.rows);
  if (turns_in(grid) <= most) {
    return 1;
  }
  for (const std::size_t least : {4U, 16U}) {
    // Where most is specks, there is nothing left to outline.
    const KindGrid left = without_specks(grid, least);
    if (turns_in(left) <= most && 2 * cells_with_kind(left) >= cells_with_kind(grid)) {
      return least;
    }
  }
  return 0;
}

}  // namespace oblique::client::plot
