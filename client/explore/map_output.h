#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "client/explore/answer.h"
#include "client/explore/map.h"

namespace oblique::client {

/// An axis of a map, with a value for each step of the lattice.
class MapAxis {
 public:
  MapAxis(std::string key, double from, double to, const MapGrid& grid);

  /// Both ends are exact. Other values are multiples of 2^-50 times the largest power of two on the
  /// axis, so that the middle of a bracket minus and plus half its width gives its ends to the bit.
  double value(std::uint32_t place) const;
  const std::string& key() const { return key_; }
  double from() const { return from_; }
  double to() const { return to_; }

 private:
  std::string key_;
  double from_;
  double to_;
  std::uint32_t last_;
  double grain_;
};

struct MapRegion {
  std::string name;
  double cells = 0.0;  ///< area in cells of the coarse grid, as the raster shows it
};

/// The result of `oblique map`.
struct FoundMap {
  std::string study;
  std::string of;
  std::array<MapAxis, 2> axes;  ///< x and y
  MapGrid grid;
  double bracket = 0.0;                 ///< part of an axis
  std::vector<MapRegion> regions = {};  ///< by number, the largest first
  Borders borders = {};
  std::vector<CurveShift> shifts = {};  ///< of each curve
  std::uint64_t points = 0;
  std::size_t rounds = 0;
  std::string over_name = {};
  /// A number at each point of the coarse grid, row by row from the lowest; NaN: none.
  std::vector<double> over = {};
};

/// Tables, rows of vertices, JSON (README.md describes it) and picture.
Answer answer_of(const FoundMap& map);

}  // namespace oblique::client
