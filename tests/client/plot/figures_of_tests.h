#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "client/plot/figure.h"

namespace oblique::client::plot::test {

inline Figure figure_with(Panel panel) {
  Figure figure{.title = "friction: a picture", .subtitle = "e = 0.9, 100 points"};
  figure.panels.push_back(std::move(panel));
  return figure;
}

inline Panel panel_over_mu_and_H() {
  Panel panel;
  panel.x = axis_of("mu", "");
  panel.y = axis_of("H", "m");
  return panel;
}

/// A grid of solved cells with the values 0, 1, 2, ...
inline Cells counted_cells(std::size_t columns, std::size_t rows) {
  const auto along = [](double from, double step, std::size_t count) {
    return cells_between({.range = {from, from + step * static_cast<double>(count)}}, count);
  };
  Cells cells{.x = along(0.0, 0.1, columns), .y = along(0.5, 0.05, rows)};
  for (std::size_t i = 0; i < columns * rows; ++i) {
    cells.values.push_back(static_cast<double>(i));
  }
  cells.states.assign(columns * rows, CellState::kSolved);
  return cells;
}

inline Figure map_of(Cells cells) {
  Panel panel = panel_over_mu_and_H();
  panel.x.range = {cells.x.edges.front(), cells.x.edges.back()};
  panel.y.range = {cells.y.edges.front(), cells.y.edges.back()};
  const bool has_numbers = cells.names.empty();
  FigureAxis colours = axis_of("duration_s", "s");
  colours.span(range_of(cells.values));
  cells.name = has_numbers ? colours.name : "major_mode";
  panel.cells = std::move(cells);
  Figure figure = figure_with(std::move(panel));
  if (has_numbers) {
    figure.colours = colours;
  }
  return figure;
}

/// A map of numbers in which one cell is unsolved, one excluded, one failed, and one has no value.
inline Figure gappy_map() {
  Cells cells = counted_cells(6, 4);
  const std::vector<std::pair<std::size_t, CellState>> gaps{{3, CellState::kNoResult},
                                                            {4, CellState::kFiltered},
                                                            {10, CellState::kFailed},
                                                            {20, CellState::kNoValue}};
  for (const auto& [cell, state] : gaps) {
    cells.states[cell] = state;
    cells.values[cell] = std::nan("");
  }
  return map_of(std::move(cells));
}

/// A map of three categories, with one unsolved cell. The third category combines rare modes.
inline Figure category_map(const std::string& name = "SC sR") {
  Cells cells = counted_cells(30, 20);
  for (std::size_t i = 0; i < cells.values.size(); ++i) {
    cells.values[i] = i % 30 < 15 ? 0.0 : i < 500 ? 1.0 : 2.0;
    cells.names.push_back(cells.values[i] == 0.0 ? name : cells.values[i] == 1.0 ? "sC" : "rare");
  }
  cells.states[0] = CellState::kNoResult;
  cells.categories = {{name, 300}, {"sC", 250}, {"2 other modes", 50, true}};
  return map_of(std::move(cells));
}

inline Figure lines_of(std::size_t lines, std::size_t points) {
  Panel panel;
  panel.x = axis_of("mu", "");
  panel.y = axis_of("duration_s", "s");
  panel.x.range = {0.01, 0.01 * static_cast<double>(points)};
  panel.y.range = {0.0, 1e-4 * static_cast<double>(lines * points)};
  for (std::size_t i = 0; i < lines; ++i) {
    Curve curve{.stroke = i, .mark = Curve::Mark::kLineAndMarks};
    if (lines > 1) {
      curve.by = 0.1 * static_cast<double>(i + 1);
      curve.name = shown_value(axis_of("e", ""), *curve.by);
      panel.by_name = "e";
    }
    for (std::size_t k = 0; k < points; ++k) {
      curve.x.push_back(0.01 * static_cast<double>(k + 1));
      curve.y.push_back(1e-4 * static_cast<double>((i + 1) * (k + 1)));
    }
    panel.curves.push_back(std::move(curve));
  }
  return figure_with(std::move(panel));
}

inline Figure some_dots() {
  Panel panel = panel_over_mu_and_H();
  Curve dots{.mark = Curve::Mark::kDots};
  for (int i = 0; i < 50; ++i) {
    dots.x.push_back(std::fmod(i * 0.618, 1.0));
    dots.y.push_back(i == 7 ? std::nan("") : std::fmod(i * 0.414, 1.0));
    dots.colours.push_back(i);
  }
  panel.curves = {std::move(dots)};
  Figure figure = figure_with(std::move(panel));
  figure.colours = axis_of("fn_peak_N", "N");
  figure.colours->range = {0.0, 49.0};
  return figure;
}

inline Figure some_bars() {
  Panel panel = panel_over_mu_and_H();
  panel.y = {.label = "points", .name = "points", .range = {0.0, 5.0}};
  panel.bars = Bars{.edges = {0.0, 0.5, 1.0, 1.5}, .heights = {1.0, 4.0, 0.0}};
  return figure_with(std::move(panel));
}

inline Figure named_bars(const std::string& name = "SC sR") {
  Panel panel;
  panel.x = {.label = "points", .name = "points", .range = {0.0, 5.0}};
  panel.y = axis_of("mode", "");
  panel.bars = Bars{.heights = {4.0, 1.0}, .names = {name, "other: 3"}};
  return figure_with(std::move(panel));
}

/// Two panels: one shows forces with spans, a gap and a published number; the other shows a shape
/// with equal scales of x and y.
inline Figure panels() {
  Panel forces;
  forces.title = "Forces";
  forces.x = {"time from touch [\u00b5s]", "t_s", {0.0, 350e-6}, false, 1e6};
  forces.y = {"force [N]", "force_N", {0.0, 5000.0}};
  forces.spans = {{0.0, 70e-6, Span::Kind::kCompression},
                  {70e-6, 170e-6, Span::Kind::kRestitution},
                  {0.0, 50e-6, Span::Kind::kStick}};
  Curve normal{.name = "F_n"};
  Curve tangential{.name = "F_t", .stroke = 1};
  for (int i = 0; i <= 35; ++i) {
    const double t = 1e-5 * i;
    normal.x.push_back(t);
    normal.y.push_back(t * (350e-6 - t) * 1.5e11);
    tangential.x.push_back(t);
    tangential.y.push_back(i == 20 ? std::nan("") : t * 1e7);
  }
  const Curve published{.name = "published",
                        .x = {57e-6},
                        .y = {4282.0},
                        .stroke = 7,
                        .mark = Curve::Mark::kDiamonds};
  forces.curves = {normal, tangential, published};
  Panel shape;
  shape.title = "shape at touch";
  shape.x = {"x [m]", "x_m", {-0.1, 1.2}};
  shape.y = {"y [m]", "y_m", {-1.0, 0.1}};
  shape.has_equal_aspect = true;
  shape.curves = {{.name = "finger", .x = {0.0, 0.4, 0.6}, .y = {0.0, -0.1, -0.5}, .stroke = 3}};
  Figure figure = figure_with(std::move(forces));
  figure.columns = 2;
  figure.panels.push_back(std::move(shape));
  return figure;
}

}  // namespace oblique::client::plot::test
