#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "client/explore/estimate.h"

// Borders between the regions of a plane, found from the regions of single points.
namespace oblique::client {

/// A point of the lattice, which has 2^halvings steps per cell along each axis.
struct LatticePoint {
  std::uint32_t x = 0;
  std::uint32_t y = 0;
};

struct MapGrid {
  std::uint32_t cells = 64;    ///< along each axis
  std::uint32_t halvings = 0;  ///< halvings of a cell's side that make a bracket short enough

  /// The grid whose brackets are at most `bracket` times the length of an axis.
  static MapGrid of(std::uint32_t cells, double bracket);
  std::uint32_t cell() const { return std::uint32_t{1} << halvings; }
  std::uint32_t last() const { return cells << halvings; }  ///< largest coordinate
};

/// Returns the region of each point, a number from 0.
using RegionsOf = std::function<std::vector<int>(const std::vector<LatticePoint>& points)>;

/// A place where a border crosses a step of the lattice, called its bracket, which starts at `low`.
struct BorderVertex {
  LatticePoint low;
  bool is_along_x = true;  ///< else along y
  int from = 0;            ///< region at the lower end of the bracket
  int to = 0;              ///< region at its upper end

  /// The lower end of the bracket along its axis.
  std::uint32_t place() const { return is_along_x ? low.x : low.y; }
};

struct Borders {
  /// Pixels of the raster along each axis.
  static constexpr std::uint32_t kRaster = 256;

  std::vector<BorderVertex> vertices = {};
  /// Vertex numbers along each border of two regions. A closed curve ends with its first vertex.
  /// Where three regions or more meet, the curves end with a shared vertex.
  std::vector<std::vector<std::size_t>> curves = {};
  /// Regions at the middles of the pixels, row by row from the lowest.
  std::vector<int> raster = {};
};

/// Finds borders: solves a coarse grid, row by row with rising y, bisects sides of cells whose ends
/// are in different regions, and halves cells that borders enter.
///
/// An island or sliver that contains no point of the grid is missed, unless a bisection meets it.
Borders find_borders(const MapGrid& grid, const RegionsOf& regions_of);

/// Distances of a curve's vertices from the border between the same regions in another solution.
struct CurveShift {
  std::size_t checked = 0;  ///< vertices
  std::size_t lost = 0;     ///< vertices without such a border within 1/8 of the axis
  double median = kNaN;     ///< distance of the other vertices, as a fraction of the axis
  double largest = kNaN;    ///< likewise
};
/// Returns the shifts of each curve, measured at one of `every` vertices and at least at one.
/// `regions_of` returns the regions in the other solution, for example on a finer mesh.
std::vector<CurveShift> find_shifts(const MapGrid& grid, const Borders& borders, std::size_t every,
                                    const RegionsOf& regions_of);

}  // namespace oblique::client
