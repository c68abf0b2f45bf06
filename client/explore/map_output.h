#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/explore/map.h"
#include "client/plot/figure.h"
#include "proto/recipe/blocks.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// An axis of a map, with a value for each step of its lattice.
class MapAxis {
 public:
  /// Throws solver::InputError for ends that the key cannot have.
  MapAxis(const solver::ParameterKey& key, double from, double to, bool is_logarithmic,
          const MapGrid& grid);

  /// Points of the coarse grid have the values of a range. Others have some trailing bits of zero,
  /// so that the middle of a bracket minus and plus half its width gives its ends to the bit.
  double value(std::uint32_t place) const;
  const std::string& key() const { return key_; }
  bool is_logarithmic() const { return is_logarithmic_; }

 private:
  std::string key_;
  bool is_logarithmic_;
  std::uint32_t cell_;  ///< steps of the lattice
  double grain_;        ///< values between the grid's are multiples of it
  protocol::RangeValues values_;
};

/// A region of a map with a nonzero area.
struct MapRegion {
  std::string name;
  double cells = 0.0;  ///< area, in cells of the coarse grid
};

/// Distance of a curve from the same curve on the finer mesh, as fractions of an axis.
struct CurveShift {
  std::size_t checked = 0;  ///< vertices
  std::size_t lost = 0;     ///< of these: no such border within an eighth of the axis
  double median = 0.0;      ///< of the others
  double largest = 0.0;
};

/// What `oblique map` has found.
struct FoundMap {
  std::string study;
  std::string of;
  std::array<MapAxis, 2> axes;  ///< x and y
  MapGrid grid;
  double bracket = 0.0;                 ///< part of an axis
  std::vector<std::string> names = {};  ///< of regions, by number
  std::vector<MapRegion> regions = {};  ///< the largest first
  Borders borders = {};
  std::vector<CurveShift> shifts = {};  ///< of each curve; empty: not asked for
  std::uint64_t points = 0;
  std::size_t rounds = 0;
  /// Region at the middle of each cell of a square raster, row by row from the lowest.
  std::vector<int> raster = {};
  std::size_t raster_cells = 0;  ///< along each axis
  /// A number at each point of the coarse grid, row by row from the lowest; NaN: none.
  std::vector<double> over = {};
  std::string over_name = {};
};

/// "A", "B", ..., "Z", "A2", ...: the letter of a region by its place among `regions`.
std::string region_letter(std::size_t place);

/// Regions and curves as tables, with notes about what a map may miss.
std::string map_table(const FoundMap& map);
/// One row a vertex: vertex,curve,x,y,from,to,width,along.
std::string map_csv(const FoundMap& map);
/// One object; README.md describes it.
std::string map_json(const FoundMap& map);
plot::Figure map_figure(const FoundMap& map);

/// "An island or sliver of another region that is smaller than a cell, 0.03 in mu by 0.01 in H, may
/// be missed."
std::string missed_sentence(const FoundMap& map);

}  // namespace oblique::client
