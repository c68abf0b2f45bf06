#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/plot/point/panels.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

Curve shape_curve(std::string name, const std::vector<double>& nodes_m, std::size_t stroke) {
  Curve curve{.name = std::move(name), .stroke = stroke};
  for (std::size_t i = 0; i + 1 < nodes_m.size(); i += 2) {
    curve.x.push_back(nodes_m[i]);
    curve.y.push_back(nodes_m[i + 1]);
  }
  return curve;
}

std::string drop_of(double drop_m) {
  return fmt::format("drop {} m", solver::readable_number(drop_m, 3));
}

}  // namespace

Panel shape_panel(const PointHistory& history) {
  const auto& lengths = history.model.lengths_m;
  const double reach_m = std::accumulate(lengths.begin(), lengths.end(), 0.0);
  Panel panel;
  panel.title = "Shape of the finger";
  panel.has_equal_aspect = true;
  std::vector<double> at_rest{0.0, 0.0};
  double joint_m = 0.0;
  for (const double length_m : lengths) {
    joint_m += length_m;
    at_rest.insert(at_rest.end(), {joint_m, 0.0});
  }
  std::size_t stroke = 1;
  panel.curves.push_back(shape_curve("at rest", at_rest, stroke++));
  for (const FallShape& fall : history.falls) {
    panel.curves.push_back(shape_curve(drop_of(fall.drop_m), fall.nodes_m, stroke++));
  }
  if (!history.rows.empty()) {
    panel.curves.push_back(shape_curve("at touch", history.rows.front().nodes_m, 0));
    panel.curves.push_back(shape_curve("at separation", history.rows.back().nodes_m, 7));
  }
  const double edge_m = 0.06 * reach_m;
  panel.x = axis_around("x [m]", "x_m", 1.0, panel.curves, true);
  panel.x.range = {std::min(panel.x.range.from, -edge_m), reach_m + edge_m};
  panel.curves.push_back({.name = "ground",
                          .x = {panel.x.range.from, panel.x.range.to},
                          .y = {-history.H_m, -history.H_m},
                          .stroke = 6});
  panel.y = axis_around("y [m]", "y_m", 1.0, panel.curves, false);
  // So that a shallow drop, drawn to scale, is more than a strip.
  const double least_m = 0.3 * (panel.x.range.to - panel.x.range.from);
  const double lacking_m = std::max(0.0, least_m - (panel.y.range.to - panel.y.range.from));
  panel.y.range = {panel.y.range.from - 0.5 * lacking_m, panel.y.range.to + 0.5 * lacking_m};
  return panel;
}

std::string shape_note(const PointHistory& history) {
  if (history.rows.empty() || history.rows.front().nodes_m.empty()) {
    return {};
  }
  double largest_m = 0.0;
  const auto& before = history.rows.front().nodes_m;
  for (const auto& row : history.rows) {
    for (std::size_t i = 0; i + 1 < before.size() && i + 1 < row.nodes_m.size(); i += 2) {
      largest_m = std::max(
          largest_m, std::hypot(row.nodes_m[i] - before[i], row.nodes_m[i + 1] - before[i + 1]));
    }
  }
  return fmt::format("From touch to separation no node moves farther than {} mm.",
                     solver::readable_number(largest_m * 1e3, 3));
}

}  // namespace oblique::client::plot
