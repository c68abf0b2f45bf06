#pragma once

#include <cstddef>
#include <vector>

namespace oblique::client::plot {

/// A corner of cells: between column x - 1 and x, and row y - 1 and y.
struct Corner {
  std::size_t x;
  std::size_t y;

  bool operator==(const Corner&) const = default;
};

/// A line along the edges of cells, from corner to corner where it turns. A closed one ends where
/// it began, without saying so again.
struct Outline {
  std::vector<Corner> corners;
};

/// Kinds of cells in a grid, row by row.
struct KindGrid {
  std::size_t columns = 0;
  std::size_t rows = 0;
  std::vector<int> kinds = {};

  int at(std::size_t x, std::size_t y) const { return kinds[y * columns + x]; }
};

/// The closed outlines of all cells of that kind, holes among them, with the cells on one side.
std::vector<Outline> outlines_of(const KindGrid& grid, int kind);

/// Lines between cells of different kinds, in straight pieces, each once; none along the grid's own
/// border, nor along cells of a kind below 0.
std::vector<Outline> boundaries_of(const KindGrid& grid);

/// Corners of all of them.
std::size_t corners_of(const std::vector<Outline>& outlines);

}  // namespace oblique::client::plot
