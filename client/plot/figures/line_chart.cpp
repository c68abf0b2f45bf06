#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/plot/figures/charts.h"

namespace oblique::client::plot {
namespace {

/// Lines that are drawn at most: more cannot be told apart.
constexpr std::size_t kMostLines = 120;
constexpr std::size_t kMostMarked = 60;  // points of a line that has marks

/// Ends and a regular choice between them.
std::vector<Series> thinned(std::vector<Series> series) {
  std::vector<Series> kept;
  for (std::size_t i = 0; i < kMostLines; ++i) {
    kept.push_back(std::move(series[i * (series.size() - 1) / (kMostLines - 1)]));
  }
  return kept;
}

}  // namespace

Figure line_chart(const Quantity& x, const Quantity& y, const std::optional<Quantity>& by,
                  std::vector<Series> series, const ChartChoice& choice) {
  Figure figure;
  const std::size_t all = series.size();
  if (all > kMostLines) {
    series = thinned(std::move(series));
    figure.notes.push_back(
        fmt::format("{} of {} lines are drawn, at equal distances.", kMostLines, shown_count(all)));
  }
  std::vector<double> xs;
  std::vector<double> ys;
  std::vector<double> bys;
  for (const Series& each : series) {
    xs.insert(xs.end(), each.x.begin(), each.x.end());
    ys.insert(ys.end(), each.y.begin(), each.y.end());
    bys.push_back(each.by);
  }
  const bool has_shades = by && series.size() > kMostNamedLines;
  if (has_shades) {
    ColourChoice colours = choice.colours;
    colours.range.reset();
    figure.colours = colours_for(*by, bys, colours);
    figure.colours->has_plate = true;
  }
  Panel panel;
  // Marks at the ends are whole.
  const bool has_marks = !has_shades && !series.empty() && series.front().x.size() <= kMostMarked;
  const Range ends = range_of(xs, choice.is_x_logarithmic);
  panel.x = axis_of(x, has_marks ? widened(ends, 0.02, choice.is_x_logarithmic) : ends,
                    choice.is_x_logarithmic);
  panel.y = axis_of(
      y,
      choice.range ? *choice.range
                   : widened(range_of(ys, choice.is_y_logarithmic), 0.05, choice.is_y_logarithmic),
      choice.is_y_logarithmic);
  if (xs.empty() || std::all_of(ys.begin(), ys.end(), [](double v) { return std::isnan(v); })) {
    say_empty(figure, "no point has a value");
  }
  std::size_t number = 0;
  for (Series& each : series) {
    Curve curve;
    curve.has_marks = has_marks;
    curve.name = by ? shown_value(*by, each.by) : std::string();
    curve.stroke = number++;
    if (by) {
      curve.by = each.by;
      panel.by_name = by->name;
    }
    if (has_shades) {
      curve.shade = each.by;
    }
    curve.x = std::move(each.x);
    curve.y = std::move(each.y);
    panel.curves.push_back(std::move(curve));
  }
  figure.panels.push_back(std::move(panel));
  return figure;
}

}  // namespace oblique::client::plot
