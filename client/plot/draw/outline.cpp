#include "client/plot/draw/outline.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

namespace oblique::client::plot {
namespace {

// Ways from a corner, in turn to the right where y grows downwards.
enum Way : std::size_t { kEast, kSouth, kWest, kNorth };

/// Edges of the cells of one kind, from each corner the ways that keep the kind on the right.
class Edges {
 public:
  Edges(const KindGrid& grid, int kind)
      : width_(grid.columns + 1), ways_(width_ * (grid.rows + 1)) {
    const auto is = [&](std::size_t x, std::size_t y) {
      return x < grid.columns && y < grid.rows && grid.at(x, y) == kind;
    };
    for (std::size_t y = 0; y < grid.rows; ++y) {
      for (std::size_t x = 0; x < grid.columns; ++x) {
        if (!is(x, y)) {
          continue;
        }
        add(y == 0 || !is(x, y - 1), x, y, kEast);
        add(!is(x + 1, y), x + 1, y, kSouth);
        add(!is(x, y + 1), x + 1, y + 1, kWest);
        add(x == 0 || !is(x - 1, y), x, y + 1, kNorth);
      }
    }
  }

  /// Walks round all of them.
  std::vector<Outline> loops() {
    std::vector<Outline> outlines;
    for (const std::size_t start : starts_) {
      while (ways_[start] != 0) {
        outlines.push_back(loop_from(start));
      }
    }
    return outlines;
  }

 private:
  void add(bool is_edge, std::size_t x, std::size_t y, Way way) {
    if (is_edge) {
      const std::size_t corner = y * width_ + x;
      if (ways_[corner] == 0) {
        starts_.push_back(corner);
      }
      ways_[corner] = static_cast<std::uint8_t>(ways_[corner] | 1U << way);
    }
  }

  std::size_t beyond(std::size_t corner, std::size_t way) const {
    const std::array<std::size_t, 4> steps{corner + 1, corner + width_, corner - 1,
                                           corner - width_};
    return steps[way];
  }

  /// The way on: where two cells meet at a corner only, to the right, so that each keeps its own.
  std::size_t next_way(std::size_t corner, std::size_t came) const {
    for (const std::size_t turn : {std::size_t{1}, std::size_t{0}, std::size_t{3}}) {
      const std::size_t way = (came + turn) % 4;
      if ((ways_[corner] >> way & 1U) != 0) {
        return way;
      }
    }
    return came;
  }

  Outline loop_from(std::size_t start) {
    std::size_t way = 0;
    while ((ways_[start] >> way & 1U) == 0) {
      ++way;
    }
    Outline outline;
    std::size_t corner = start;
    const std::size_t first_way = way;
    do {
      outline.corners.push_back({corner % width_, corner / width_});
      const std::size_t straight = way;
      do {
        ways_[corner] = static_cast<std::uint8_t>(ways_[corner] & ~(1U << way));
        corner = beyond(corner, way);
        way = corner == start && ways_[corner] == 0 ? first_way : next_way(corner, way);
      } while (way == straight && corner != start);
    } while (corner != start);
    return outline;
  }

  std::size_t width_;
  std::vector<std::uint8_t> ways_;
  std::vector<std::size_t> starts_;
};

}  // namespace

std::vector<Outline> outlines_of(const KindGrid& grid, int kind) {
  return Edges(grid, kind).loops();
}

std::vector<Outline> boundaries_of(const KindGrid& grid) {
  std::vector<Outline> lines;
  const auto differ = [](int one, int other) { return one != other && one >= 0 && other >= 0; };
  for (std::size_t y = 1; y < grid.rows; ++y) {
    for (std::size_t x = 0; x < grid.columns; ++x) {
      const std::size_t begin = x;
      while (x < grid.columns && differ(grid.at(x, y), grid.at(x, y - 1))) {
        ++x;
      }
      if (x > begin) {
        lines.push_back({{{begin, y}, {x, y}}});
      }
    }
  }
  for (std::size_t x = 1; x < grid.columns; ++x) {
    for (std::size_t y = 0; y < grid.rows; ++y) {
      const std::size_t begin = y;
      while (y < grid.rows && differ(grid.at(x, y), grid.at(x - 1, y))) {
        ++y;
      }
      if (y > begin) {
        lines.push_back({{{x, begin}, {x, y}}});
      }
    }
  }
  return lines;
}

std::size_t corners_of(const std::vector<Outline>& outlines) {
  std::size_t corners = 0;
  for (const Outline& outline : outlines) {
    corners += outline.corners.size();
  }
  return corners;
}

}  // namespace oblique::client::plot
