#include "client/plot/point_figure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/row_output.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

using solver::readable_number;
using solver::TraceRow;

/// Time spans of compression and restitution, followed by the stick intervals.
std::vector<Span> spans_of(const PointHistory& history) {
  std::vector<Span> spans;
  const auto& rows = history.rows;
  for (const auto& [kind, letter, place] : {std::tuple{Span::Kind::kCompression, 'C', 1U},
                                            {Span::Kind::kRestitution, 'R', 1U},
                                            {Span::Kind::kStick, 'S', 0U}}) {
    bool is_open = false;
    for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
      const bool is_inside = rows[i].state.at(place) == letter;
      if (is_inside && !is_open) {
        spans.push_back({rows[i].t_s, 0.0, kind});
      }
      if (is_inside) {
        spans.back().to = rows[i + 1].t_s;
      }
      is_open = is_inside;
    }
  }
  return spans;
}

/// Energy [J] that the finger has transferred to the contact since touch: dissipated by friction at
/// the contact particle P, and stored or dissipated in the normal and tangential element. The
/// trapezoidal sums over the positions of tip and P are exact for the normal element; those for the
/// tangential element are exact while P sticks.
std::pair<Curve, Curve> contact_energies(const PointHistory& history) {
  auto friction = curve_of(history, "lost to friction", 1, &TraceRow::t_s);
  auto element = curve_of(history, "in the normal and tangential element", 3, &TraceRow::t_s);
  double friction_J = 0.0;
  double element_J = 0.0;
  const auto& rows = history.rows;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto& row = rows[i];
    const auto& before = rows[i == 0 ? 0 : i - 1];
    const double fn_N = 0.5 * (before.fn_N + row.fn_N);
    const double ft_N = 0.5 * (before.ft_N + row.ft_N);
    // Work of the tip against normal and tangential force; the part that moves P is dissipated.
    const double lost_J = -ft_N * (row.xP_m - before.xP_m);
    friction_J += lost_J;
    element_J += -fn_N * (row.y_m - before.y_m) - ft_N * (row.x_m - before.x_m) - lost_J;
    friction.y[i] = friction_J;
    element.y[i] = element_J;
  }
  return {std::move(friction), std::move(element)};
}

/// Returns an empty panel over time, with phases and stick intervals shaded.
Panel over_time(const PointHistory& history, std::string title, FigureAxis axis,
                std::vector<Curve> curves) {
  Panel panel;
  panel.title = std::move(title);
  panel.x = time_axis(history.duration_s());
  panel.y = std::move(axis);
  panel.spans = spans_of(history);
  panel.curves = std::move(curves);
  fit(panel.y, panel.curves, &Curve::y);
  return panel;
}

Panel energies_panel(const PointHistory& history) {
  std::vector<Curve> curves{curve_of(history, "kinetic, change", 0, &TraceRow::kinetic_J),
                            curve_of(history, "strain, change", 2, &TraceRow::strain_J),
                            curve_of(history, "gravity, change", 6, &TraceRow::gravity_J)};
  for (Curve& curve : curves) {
    const double first = curve.y.empty() ? 0.0 : curve.y.front();
    for (double& value : curve.y) {
      value -= first;
    }
  }
  auto [friction, element] = contact_energies(history);
  curves.push_back(std::move(friction));
  curves.push_back(std::move(element));
  return over_time(history, "Energies since touch", {.label = "energy [J]", .name = "energy_J"},
                   std::move(curves));
}

/// Returns the rows of all compressions or all restitutions as one curve, with gaps between phases.
Curve branch_of(const PointHistory& history, char phase, std::string name, std::size_t stroke) {
  Curve curve{.name = std::move(name), .stroke = stroke};
  const auto& rows = history.rows;
  bool is_open = false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool begins = i + 1 < rows.size() && rows[i].state.ends_with(phase);
    if (begins || is_open) {
      curve.x.push_back(-rows[i].uy_m);
      curve.y.push_back(rows[i].fn_N);
    }
    if (is_open && !begins) {
      curve.x.push_back(std::numeric_limits<double>::quiet_NaN());
      curve.y.push_back(std::numeric_limits<double>::quiet_NaN());
    }
    is_open = begins;
  }
  return curve;
}

Panel loop_panel(const PointHistory& history) {
  Panel panel;
  panel.title = "Hysteresis of the normal element";
  panel.curves = {branch_of(history, 'C', "compression", 0),
                  branch_of(history, 'R', "restitution", 1)};
  panel.x = {.label = "compression \u2212u_y [\u00b5m]", .name = "minus_uy_m", .per_unit = kMicro};
  panel.y = {.label = "normal force F_n [N]", .name = "fn_N"};
  fit(panel.x, panel.curves, &Curve::x);
  fit(panel.y, panel.curves, &Curve::y);
  return panel;
}

Panel shape_panel(const PointHistory& history) {
  const auto& lengths = history.model.lengths_m;
  const double reach_m = std::accumulate(lengths.begin(), lengths.end(), 0.0);
  Panel panel;
  panel.title = "Shape of the finger";
  panel.has_equal_aspect = true;
  const auto add = [&panel](std::string name, const std::vector<double>& nodes_m,
                            std::size_t stroke) {
    Curve curve{.name = std::move(name), .stroke = stroke};
    for (std::size_t i = 0; i + 1 < nodes_m.size(); i += 2) {
      curve.x.push_back(nodes_m[i]);
      curve.y.push_back(nodes_m[i + 1]);
    }
    panel.curves.push_back(std::move(curve));
  };
  std::vector<double> at_rest{0.0, 0.0};
  for (const double length_m : lengths) {
    at_rest.insert(at_rest.end(), {at_rest[at_rest.size() - 2] + length_m, 0.0});
  }
  add("at rest", at_rest, 1);
  for (const FallShape& fall : history.falls) {
    add(fmt::format("drop {} m", readable_number(fall.drop_m, 3)), fall.nodes_m,
        panel.curves.size() + 1);
  }
  if (!history.rows.empty()) {
    add("at touch", history.rows.front().nodes_m, 0);
    add("at separation", history.rows.back().nodes_m, 7);
  }
  panel.x = {.label = "x [m]", .name = "x_m"};
  panel.y = {.label = "y [m]", .name = "y_m"};
  fit(panel.x, panel.curves, &Curve::x);
  const double edge_m = 0.06 * reach_m;
  panel.x.range = {std::min(panel.x.range.from, -edge_m), reach_m + edge_m};
  add("ground", {panel.x.range.from, -history.H_m, panel.x.range.to, -history.H_m}, 6);
  fit(panel.y, panel.curves, &Curve::y);
  // Gives the panel enough height for a shallow drop that is drawn to scale.
  const double least_m = 0.3 * (panel.x.range.to - panel.x.range.from);
  const double lacking_m = std::max(0.0, least_m - (panel.y.range.to - panel.y.range.from));
  panel.y.range = {panel.y.range.from - 0.5 * lacking_m, panel.y.range.to + 0.5 * lacking_m};
  return panel;
}

std::string energy_note(const solver::ContactEnergy& energy) {
  // With e* = 1 the loss consists of rounding errors only.
  const double lost_J =
      energy.restitution_J > 1e-12 * energy.exchanged_J ? energy.restitution_J : 0.0;
  return fmt::format(
      "Error of the energy balance: {} of the energy exchanged in contact; {} J are lost to "
      "friction, {} J in restitution.",
      readable_number(energy.closure, 2), readable_number(energy.friction_J, 4),
      readable_number(lost_J, 4));
}

}  // namespace

Curve curve_of(const PointHistory& history, std::string name, std::size_t stroke, Column y,
               Column x) {
  Curve curve{.name = std::move(name), .stroke = stroke};
  for (const TraceRow& row : history.rows) {
    curve.x.push_back(row.*x);
    curve.y.push_back(row.*y);
  }
  return curve;
}

FigureAxis time_axis(double duration_s) {
  return {.label = "time since touch [\u00b5s]",
          .name = "t_s",
          .range = {0.0, duration_s > 0.0 ? duration_s : 1e-6},
          .per_unit = kMicro};
}

void fit(FigureAxis& axis, const std::vector<Curve>& curves, std::vector<double> Curve::*values) {
  std::vector<double> all;
  for (const Curve& curve : curves) {
    all.insert(all.end(), (curve.*values).begin(), (curve.*values).end());
  }
  axis.span(range_of(all), 0.05);
}

std::optional<PointPanel> point_panel_named(const std::string& name) {
  if (name.empty()) {
    return std::nullopt;
  }
  return static_cast<PointPanel>(choice_of("--panel", name, kPointPanels));
}

Panel panel_of(const PointHistory& history, PointPanel panel) {
  switch (panel) {
    case PointPanel::kForces:
      return over_time(history, "Contact forces", {.label = "force [N]", .name = "force_N"},
                       {curve_of(history, "normal force F_n", 0, &TraceRow::fn_N),
                        curve_of(history, "tangential force F_t", 1, &TraceRow::ft_N)});
    case PointPanel::kLoop:
      return loop_panel(history);
    case PointPanel::kDeformation:
      return over_time(
          history, "Deformation of the contact",
          {.label = "deformation [\u00b5m]", .name = "deformation_m", .per_unit = kMicro},
          {curve_of(history, "normal u_y", 0, &TraceRow::uy_m),
           curve_of(history, "tangential u_x", 1, &TraceRow::ux_m)});
    case PointPanel::kVelocities:
      return over_time(history, "Velocities", {.label = "velocity [m/s]", .name = "velocity_m_s"},
                       {curve_of(history, "tip, tangential", 0, &TraceRow::vt_m_s),
                        curve_of(history, "tip, normal", 1, &TraceRow::vn_m_s),
                        curve_of(history, "P, along the ground", 2, &TraceRow::vP_m_s)});
    case PointPanel::kEnergies:
      return energies_panel(history);
    case PointPanel::kShape:
      break;
  }
  return shape_panel(history);
}

Figure point_figure(const PointHistory& history, std::optional<PointPanel> panel) {
  Figure figure{.title = history.name.empty() ? "Impact of the finger" : history.name};
  figure.subtitle = fmt::format(
      "H = {} m, \u03bc = {}, e* = {}; {} elements a link; contact {} \u00b5s",
      readable_number(history.H_m), readable_number(history.mu), readable_number(history.e_star),
      history.model.elements_per_link, readable_number(history.duration_s() * kMicro, 5));
  if (history.result) {
    figure.subtitle +=
        fmt::format(", F_n up to {} N, mode {}", readable_number(history.result->fn_peak_N, 5),
                    history.result->major_mode);
  }
  if (panel) {
    figure.panels.push_back(panel_of(history, *panel));
    figure.title += ": " + std::exchange(figure.panels.front().title, {});
    figure.panel_size = {760.0, 460.0};
  } else {
    figure.columns = 2;
    figure.panel_size = {520.0, 340.0};
    for (std::size_t i = 0; i < kPointPanels.size(); ++i) {
      figure.panels.push_back(panel_of(history, static_cast<PointPanel>(i)));
    }
  }
  const auto shows = [&](PointPanel one) { return !panel || *panel == one; };
  if (shows(PointPanel::kEnergies) && history.result) {
    figure.notes.push_back(energy_note(history.result->energy));
  }
  if (shows(PointPanel::kLoop) && history.e_star == 1.0) {
    figure.notes.emplace_back("With e* = 1 restitution follows the compression line.");
  }
  figure.notes.insert(figure.notes.end(), history.remarks.begin(), history.remarks.end());
  return figure;
}

}  // namespace oblique::client::plot
