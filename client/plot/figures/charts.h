#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/plot/figures/figure.h"
#include "client/plot/figures/maps.h"
#include "client/plot/figures/quantity.h"

namespace oblique::client::plot {

/// One line of a chart: the values of an output over an axis, at one value of another.
struct Series {
  double by = 0.0;
  std::vector<double> x = {};
  std::vector<double> y = {};  ///< NaN: no value there
};

/// Which axes are logarithmic, and the range of the vertical one or of colours.
struct ChartChoice {
  bool is_x_logarithmic = false;
  bool is_y_logarithmic = false;
  ColourChoice colours = {};        ///< its range is that of colours, where there are any
  std::optional<Range> range = {};  ///< of the values that are drawn; none: theirs
};

/// Most lines that have a legend; more are coloured by their value.
inline constexpr std::size_t kMostNamedLines = 8;

/// Lines of an output over an axis. `by`: whose values tell the lines apart; none: there is one.
Figure line_chart(const Quantity& x, const Quantity& y, const std::optional<Quantity>& by,
                  std::vector<Series> series, const ChartChoice& choice);

/// Most points that are drawn one by one; more are counted in cells.
inline constexpr std::size_t kMostDots = 4000;

/// Points over two columns; with a colour, by a third. Many are gathered in cells, whose colours
/// say how many there are, or the mean of the third; the subtitle says so.
Figure scatter(const Quantity& x, const Quantity& y, const std::optional<Quantity>& colour,
               const Dots& dots, const ChartChoice& choice);

/// How often values are met, in bins of one round width, as many as Freedman and Diaconis advise
/// and at most 100.
Figure histogram(const Quantity& quantity, const std::vector<double>& values,
                 const ChartChoice& choice);

/// How often names are met: the most frequent, largest first, and the others together.
Figure name_counts(const Quantity& quantity, const std::vector<std::string>& names,
                   const std::vector<std::uint64_t>& counts);

}  // namespace oblique::client::plot
