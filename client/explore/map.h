#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

// Borders between the regions of a plane, found from the regions of single points.
namespace oblique::client {

/// A point of the lattice, which has 2^halvings steps a cell along each axis.
struct LatticePoint {
  std::uint32_t x = 0;
  std::uint32_t y = 0;

  bool operator==(const LatticePoint&) const = default;
};

struct MapGrid {
  std::uint32_t cells = 64;    ///< along each axis
  std::uint32_t halvings = 0;  ///< of a cell's side, until a bracket is short enough

  /// The grid whose brackets are at most `bracket` times an axis.
  static MapGrid of(std::uint32_t cells, double bracket);
  std::uint32_t cell() const { return std::uint32_t{1} << halvings; }
  std::uint32_t last() const { return cells << halvings; }  ///< largest coordinate
};

/// Returns the region of each point, a number from 0.
using RegionsOf = std::function<std::vector<int>(const std::vector<LatticePoint>& points)>;

/// A point of a border. Its bracket is the step of the lattice from `low` along one axis.
struct BorderVertex {
  LatticePoint low;
  bool is_along_x = true;  ///< else along y
  int from = 0;            ///< region at the lower end of the bracket
  int to = 0;              ///< region at its upper end
};

struct Borders {
  /// Side of the raster in cells.
  static constexpr std::uint32_t kRaster = 256;

  std::vector<BorderVertex> vertices = {};
  /// Vertex numbers along each border of two regions. A closed curve ends with its first vertex.
  /// Where three regions or more meet, the curves end with a shared vertex.
  std::vector<std::vector<std::size_t>> curves = {};
  std::vector<int> raster =
      {};  ///< regions at the middles of its cells, row by row from the lowest
};

/// Finds borders: a coarse grid is solved, row by row with rising y; sides of cells whose ends are
/// in different regions are bisected; cells that more than two borders enter are halved.
///
/// An island or sliver that contains no point of the grid is missed, unless a bisection meets it.
Borders find_borders(const MapGrid& grid, const RegionsOf& regions_of);

/// How far a curve is from the border of the same regions in another solution.
struct CurveShift {
  std::size_t checked = 0;             ///< vertices
  std::size_t lost = 0;                ///< vertices without such a border within 1/8 of the axis
  std::optional<double> median = {};   ///< of the others, as a part of the axis
  std::optional<double> largest = {};  ///< likewise
};
/// The shifts of each curve, from one of `every` vertices and at least one. `regions_of` returns
/// the regions in the other solution, as on a finer mesh.
std::vector<CurveShift> find_shifts(const MapGrid& grid, const Borders& borders, std::size_t every,
                                    const RegionsOf& regions_of);

}  // namespace oblique::client
