#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/plot/figures/charts.h"
#include "client/plot/figures/figure.h"
#include "client/plot/figures/maps.h"

namespace oblique::client::plot::test {

inline MapAxes usual_axes() {
  return {quantity_of("mu", ""), quantity_of("H", "m")};
}

/// Cells n by m, all solved, with the values 0, 1, 2, ...
inline Cells counted_cells(std::size_t columns, std::size_t rows) {
  Cells cells;
  for (std::size_t i = 0; i <= columns; ++i) {
    cells.x_edges.push_back(0.1 * static_cast<double>(i));
  }
  for (std::size_t i = 0; i <= rows; ++i) {
    cells.y_edges.push_back(0.5 + 0.05 * static_cast<double>(i));
  }
  for (std::size_t i = 0; i < columns * rows; ++i) {
    cells.values.push_back(static_cast<double>(i));
  }
  cells.states.assign(columns * rows, CellState::kSolved);
  return cells;
}

inline Figure titled(Figure figure) {
  figure.title = "friction: a picture";
  figure.subtitle = "e = 0.9, 100 points";
  return figure;
}

/// A heat map with a cell that has no result, one that failed, and one without a value.
inline Figure gappy_map() {
  Cells cells = counted_cells(6, 4);
  cells.states[3] = CellState::kNoResult;
  cells.states[4] = CellState::kNoResult;
  cells.states[10] = CellState::kFailed;
  cells.states[20] = CellState::kNoValue;
  for (const std::size_t i : {3U, 4U, 10U, 20U}) {
    cells.values[i] = std::nan("");
  }
  return titled(heat_map(usual_axes(), quantity_of("duration_s", "s"), std::move(cells)));
}

/// A map of modes with a point a cell.
inline Figure modes_of(Cells cells, std::vector<std::string> names) {
  std::map<std::string, std::uint64_t> points;
  for (const std::string& name : names) {
    ++points[name];
  }
  return kind_map(usual_axes(), "major_mode", std::move(cells), std::move(names), points, "modes");
}

/// A map of so many kinds in stripes, the first widest.
inline Figure striped_kinds(std::size_t kinds) {
  Cells cells = counted_cells(60, 40);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < 2400; ++i) {
    const std::size_t kind = i % 60 < 20 ? 0 : 1 + (i % 60 - 20) * kinds / 40 % kinds;
    std::string name = "SC sR";
    for (std::size_t k = 0; k < kind % 6; ++k) {
      name += k % 2 == 0 ? " sC" : " SR";
    }
    names.push_back(name + " " + std::to_string(kind));
  }
  return titled(modes_of(std::move(cells), std::move(names)));
}

inline Figure lines_of_count(std::size_t lines, std::size_t points = 12) {
  std::vector<Series> series;
  for (std::size_t i = 0; i < lines; ++i) {
    Series line{.by = 0.1 * static_cast<double>(i + 1), .x = {}, .y = {}};
    for (std::size_t k = 0; k < points; ++k) {
      line.x.push_back(0.01 * static_cast<double>(k + 1));
      line.y.push_back(1e-4 * static_cast<double>((i + 1) * (k + 1)));
    }
    series.push_back(std::move(line));
  }
  return titled(line_chart(quantity_of("mu", ""), quantity_of("duration_s", "s"),
                           lines > 1 ? std::optional(quantity_of("e", "")) : std::nullopt,
                           std::move(series), {}));
}

inline Figure dots_of_count(std::size_t count) {
  Dots dots;
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = static_cast<double>(i);
    dots.x.push_back(std::fmod(at * 0.618, 1.0));
    dots.y.push_back(std::fmod(at * 0.414, 1.0) * 5000.0);
    dots.shades.push_back(at);
  }
  return titled(scatter(quantity_of("mu", ""), quantity_of("fn_peak_N", "N"), quantity_of("H", "m"),
                        dots, {}));
}

inline Figure histogram_of_count(std::size_t count) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) {
    values.push_back(std::fmod(static_cast<double>(i) * 0.618, 1.0) * 2e-4 + 3e-4);
  }
  return titled(histogram(quantity_of("duration_s", "s"), values, {}));
}

/// What a point's picture is made of: panels below each other with spans, curves and known points,
/// and a drawing with one scale both ways.
inline Figure panels() {
  Figure figure;
  Panel forces;
  forces.x = {"time from touch [\u00b5s]", "t_s", {0.0, 350e-6}, false, 1e6};
  forces.y = {"force [N]", "force_N", {0.0, 5000.0}};
  forces.spans = {
      {0.0, 70e-6, 2, "stick"}, {70e-6, 170e-6, 0, "compression"}, {200e-6, 350e-6, 2, "stick"}};
  Curve normal{.name = "F_n"};
  Curve tangential{.name = "F_t", .stroke = 1};
  for (int i = 0; i <= 35; ++i) {
    const double t = 1e-5 * i;
    normal.x.push_back(t);
    normal.y.push_back(t * (350e-6 - t) * 1.5e11);
    tangential.x.push_back(t);
    tangential.y.push_back(i == 20 ? std::nan("") : t * 1e7);
  }
  forces.curves = {normal, tangential};
  forces.known = {{57e-6, 4282.0, "published"}};
  Panel energy = forces;
  energy.y = {"energy [J]", "energy_J", {-1e-6, 1e-6}};
  energy.curves = {{.name = "closure", .x = {0.0, 350e-6}, .y = {-1e-6, 1e-6}, .stroke = 2}};
  energy.known.clear();
  energy.share = 0.5;
  Panel shape;
  shape.title = "shape at touch";
  shape.x = {"x [m]", "x_m", {-0.1, 1.2}};
  shape.y = {"y [m]", "y_m", {-1.0, 0.1}};
  shape.has_equal_aspect = true;
  shape.curves = {{.name = "finger",
                   .x = {0.0, 0.4, 0.6, 0.585},
                   .y = {0.0, -0.1, -0.5, -1.0},
                   .stroke = 3,
                   .has_marks = true}};
  figure.panels = {forces, energy, shape};
  return titled(figure);
}

}  // namespace oblique::client::plot::test
