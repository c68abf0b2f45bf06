#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/plot/figures/charts.h"

namespace oblique::client::plot {
namespace {

constexpr std::size_t kMostColumns = 160;
constexpr std::size_t kMostRows = 110;

/// So many cells that those of values in equal steps, as of a grid's axis, are next to each other:
/// between narrower ones there were stripes.
std::size_t cells_for(const std::vector<double>& values, std::size_t most) {
  std::unordered_set<double> different;
  for (const double value : values) {
    if (std::isfinite(value) && different.insert(value).second && different.size() > 2 * most) {
      return most;
    }
  }
  return std::clamp<std::size_t>(different.size() * 9 / 10, 2, most);
}

/// The number of the cell that a share lies in; outside: the number of cells.
std::size_t cell_of(double share, std::size_t cells) {
  if (!(share >= 0.0 && share <= 1.0)) {
    return cells;
  }
  return std::min(static_cast<std::size_t>(share * static_cast<double>(cells)), cells - 1);
}

std::vector<double> equal_edges(const Scale& scale, std::size_t cells) {
  std::vector<double> edges;
  for (std::size_t i = 0; i <= cells; ++i) {
    edges.push_back(scale.value_at(static_cast<double>(i) / static_cast<double>(cells)));
  }
  return edges;
}

/// Gathers points in cells of equal size: how many, or the mean of their shades.
Cells gathered_in_cells(const Dots& dots, const Scale& x, const Scale& y) {
  const std::size_t columns = cells_for(dots.x, kMostColumns);
  const std::size_t rows = cells_for(dots.y, kMostRows);
  Cells cells{equal_edges(x, columns), equal_edges(y, rows), {}, {}};
  std::vector<double> sums(columns * rows, 0.0);
  std::vector<std::uint64_t> counts(columns * rows, 0);
  for (std::size_t i = 0; i < dots.x.size(); ++i) {
    const std::size_t column = cell_of(x.share_of(dots.x[i]), columns);
    const std::size_t row = cell_of(y.share_of(dots.y[i]), rows);
    const double shade = dots.shades.empty() ? 1.0 : dots.shades[i];
    if (column < columns && row < rows && std::isfinite(shade)) {
      sums[row * columns + column] += shade;
      ++counts[row * columns + column];
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const auto n = static_cast<double>(counts[i]);
    cells.values.push_back(counts[i] == 0        ? std::numeric_limits<double>::quiet_NaN()
                           : dots.shades.empty() ? n
                                                 : sums[i] / n);
    cells.states.push_back(counts[i] == 0 ? CellState::kNoPoint : CellState::kSolved);
  }
  return cells;
}

std::size_t without_place(const std::vector<double>& values, bool is_logarithmic) {
  return static_cast<std::size_t>(std::count_if(
      values.begin(), values.end(),
      [is_logarithmic](double v) { return !std::isfinite(v) || (is_logarithmic && v <= 0.0); }));
}

/// One point may lack several of its values.
void say_what_is_missing(Figure& figure, const Dots& dots, const ChartChoice& choice) {
  const std::size_t missing = std::max({without_place(dots.x, choice.is_x_logarithmic),
                                        without_place(dots.y, choice.is_y_logarithmic),
                                        without_place(dots.shades, choice.colours.is_logarithmic)});
  if (missing > 0) {
    figure.notes.push_back(fmt::format("{} of {} points lack a value that can be drawn.",
                                       shown_count(missing), shown_count(dots.x.size())));
  }
  if (missing == dots.x.size()) {
    say_empty(figure, "no point has both values");
  }
}

}  // namespace

Figure scatter(const Quantity& x, const Quantity& y, const std::optional<Quantity>& colour,
               const Dots& dots, const ChartChoice& choice) {
  Figure figure;
  Panel panel;
  const auto range_for = [](const std::vector<double>& values, bool is_logarithmic) {
    return widened(range_of(values, is_logarithmic), 0.03, is_logarithmic);
  };
  panel.x = axis_of(x, range_for(dots.x, choice.is_x_logarithmic), choice.is_x_logarithmic);
  panel.y = axis_of(y, range_for(dots.y, choice.is_y_logarithmic), choice.is_y_logarithmic);
  say_what_is_missing(figure, dots, choice);
  if (dots.x.size() <= kMostDots) {
    if (colour) {
      figure.colours = colours_for(*colour, dots.shades, choice.colours);
      figure.colours->has_plate = true;
    }
    panel.dots = dots;
    figure.panels.push_back(std::move(panel));
    return figure;
  }
  const Scale x_scale(panel.x.range.from, panel.x.range.to, panel.x.is_logarithmic);
  const Scale y_scale(panel.y.range.from, panel.y.range.to, panel.y.is_logarithmic);
  panel.x.range = {x_scale.from(), x_scale.to()};
  panel.y.range = {y_scale.from(), y_scale.to()};
  panel.cells = gathered_in_cells(dots, x_scale, y_scale);
  ColourChoice colours = choice.colours;
  Quantity quantity{"points", "points in a cell", 1.0};
  if (colour) {
    quantity = {colour->name, fmt::format("mean of {}", colour->label), colour->per_unit};
  } else {
    colours.is_logarithmic = true;
    colours.range.reset();
  }
  figure.colours = colours_for(quantity, panel.cells->values, colours);
  figure.colours->has_plate = true;
  figure.notes.push_back(
      fmt::format("{} points, gathered in {} x {} cells; colours are {}.",
                  shown_count(dots.x.size()), panel.cells->columns(), panel.cells->rows(),
                  colour ? "means of their points" : "the number of their points"));
  figure.panels.push_back(std::move(panel));
  return figure;
}

}  // namespace oblique::client::plot
