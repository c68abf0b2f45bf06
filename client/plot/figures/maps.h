#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/plot/figures/figure.h"
#include "client/plot/figures/quantity.h"

namespace oblique::client::plot {

/// The two axes of a map.
struct MapAxes {
  Quantity x;
  Quantity y;
  bool is_x_logarithmic = false;
  bool is_y_logarithmic = false;
};

/// How values become colours.
struct ColourChoice {
  bool is_logarithmic = false;
  std::optional<Range> range = {};  ///< none: that of the values
};

/// A heat map of cells. On a logarithmic scale of colours values that are not positive are gaps.
Figure heat_map(const MapAxes& axes, const Quantity& value, Cells cells,
                const ColourChoice& choice = {});

/// The colours of values, and whether some lie beyond.
Colours colours_for(const Quantity& quantity, const std::vector<double>& values,
                    const ColourChoice& choice);

/// Most kinds that a map tells apart. Others, and those that have next to no points, are gathered.
inline constexpr std::size_t kMostKinds = 12;

/// A map of kinds, as of modes. `names` is the kind of each solved cell, `points` the number of
/// points of each kind: the legend lists the kinds with most points first, with their percentages.
Figure kind_map(const MapAxes& axes, const std::string& name, Cells cells,
                std::vector<std::string> names, const std::map<std::string, std::uint64_t>& points,
                const std::string& plural = "kinds");

}  // namespace oblique::client::plot
