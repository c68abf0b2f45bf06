#include "client/plot/point_figure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

/// Spans in which `is_inside` holds of the state that begins each row.
template <class Inside>
void add_spans(std::vector<Span>& spans, const PointHistory& history, Span::Kind kind,
               const Inside& is_inside) {
  const auto& rows = history.rows;
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    if (!is_inside(rows[i].state)) {
      continue;
    }
    const bool goes_on =
        !spans.empty() && spans.back().kind == kind && i > 0 && is_inside(rows[i - 1].state);
    if (goes_on) {
      spans.back().to = rows[i + 1].t_s;
    } else {
      spans.push_back({rows[i].t_s, rows[i + 1].t_s, kind});
    }
  }
}

std::string values_of(const PointHistory& history) {
  return fmt::format("H = {} m, \u03bc = {}, e* = {}", solver::readable_number(history.H_m),
                     solver::readable_number(history.mu), solver::readable_number(history.e_star));
}

}  // namespace

std::vector<Span> spans_of(const PointHistory& history) {
  std::vector<Span> spans;
  add_spans(spans, history, Span::Kind::kCompression,
            [](const std::string& state) { return state.ends_with('C'); });
  add_spans(spans, history, Span::Kind::kRestitution,
            [](const std::string& state) { return state.ends_with('R'); });
  add_spans(spans, history, Span::Kind::kStick,
            [](const std::string& state) { return state.starts_with('S'); });
  return spans;
}

double duration_s(const PointHistory& history) {
  return history.rows.empty() ? 0.0 : history.rows.back().t_s;
}

FigureAxis time_axis(double duration_s) {
  return {"time since touch [\u00b5s]",
          "t_s",
          {0.0, duration_s > 0.0 ? duration_s : 1e-6},
          false,
          kMicro};
}

FigureAxis axis_around(std::string label, std::string name, double per_unit,
                       const std::vector<Curve>& curves, bool of_x) {
  std::vector<double> ends;
  for (const Curve& curve : curves) {
    if (curve.x.empty()) {
      continue;
    }
    const Range range = range_of(of_x ? curve.x : curve.y);
    ends.push_back(range.from);
    ends.push_back(range.to);
  }
  const Range range = range_of(ends);
  constexpr double kMore = 0.05;
  const double more = (range.to - range.from) * kMore;
  return {std::move(label), std::move(name), {range.from - more, range.to + more}, false, per_unit};
}

EnergyHistory energies_of(const PointHistory& history) {
  EnergyHistory energies;
  double friction_J = 0.0;
  double element_J = 0.0;
  const auto& rows = history.rows;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto& row = rows[i];
    const auto& before = rows[i == 0 ? 0 : i - 1];
    const double fn_N = 0.5 * (before.fn_N + row.fn_N);
    const double ft_N = 0.5 * (before.ft_N + row.ft_N);
    // What the tip gives is work against both forces; what P takes of it is lost.
    const double lost_J = -ft_N * (row.xP_m - before.xP_m);
    friction_J += lost_J;
    element_J += -fn_N * (row.y_m - before.y_m) - ft_N * (row.x_m - before.x_m) - lost_J;
    energies.kinetic.push_back(row.kinetic_J - rows.front().kinetic_J);
    energies.strain.push_back(row.strain_J - rows.front().strain_J);
    energies.gravity.push_back(row.gravity_J - rows.front().gravity_J);
    energies.friction.push_back(friction_J);
    energies.element.push_back(element_J);
  }
  return energies;
}

namespace {

using solver::TraceRow;

/// A panel over time, with phases and stick shaded.
Panel over_time(const PointHistory& history, std::string title, std::string label, std::string name,
                double per_unit, std::vector<Curve> curves) {
  Panel panel;
  panel.title = std::move(title);
  panel.x = time_axis(duration_s(history));
  panel.y = axis_around(std::move(label), std::move(name), per_unit, curves, false);
  panel.spans = spans_of(history);
  panel.curves = std::move(curves);
  return panel;
}

template <class Of>
Curve curve_of(const PointHistory& history, std::string name, std::size_t stroke, const Of& of) {
  return {.name = std::move(name),
          .x = series_of(history, [](const TraceRow& row) { return row.t_s; }),
          .y = series_of(history, of),
          .stroke = stroke};
}

Panel forces_panel(const PointHistory& history) {
  return over_time(
      history, "Contact forces", "force [N]", "force_N", 1.0,
      {curve_of(history, "normal force F_n", 0, [](const TraceRow& row) { return row.fn_N; }),
       curve_of(history, "tangential force F_t", 1, [](const TraceRow& row) { return row.ft_N; })});
}

/// The rows of compression, or of restitution, with gaps between.
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
  panel.x =
      axis_around("compression \u2212u_y [\u00b5m]", "minus_uy_m", kMicro, panel.curves, true);
  panel.y = axis_around("normal force F_n [N]", "fn_N", 1.0, panel.curves, false);
  return panel;
}

Panel deformation_panel(const PointHistory& history) {
  return over_time(
      history, "Deformation of the contact", "deformation [\u00b5m]", "deformation_m", kMicro,
      {curve_of(history, "normal u_y", 0, [](const TraceRow& row) { return row.uy_m; }),
       curve_of(history, "tangential u_x", 1, [](const TraceRow& row) { return row.ux_m; })});
}

Panel velocities_panel(const PointHistory& history) {
  return over_time(
      history, "Velocities", "velocity [m/s]", "velocity_m_s", 1.0,
      {curve_of(history, "tip, tangential", 0, [](const TraceRow& row) { return row.vt_m_s; }),
       curve_of(history, "tip, normal", 1, [](const TraceRow& row) { return row.vn_m_s; }),
       curve_of(history, "P, along the ground", 2,
                [](const TraceRow& row) { return row.vP_m_s; })});
}

Panel energies_panel(const PointHistory& history) {
  const EnergyHistory energies = energies_of(history);
  const auto t_s = series_of(history, [](const TraceRow& row) { return row.t_s; });
  const auto curve = [&t_s](std::string name, std::size_t stroke, const std::vector<double>& y) {
    return Curve{.name = std::move(name), .x = t_s, .y = y, .stroke = stroke};
  };
  return over_time(
      history, "Energies since touch", "energy [J]", "energy_J", 1.0,
      {curve("kinetic, change", 0, energies.kinetic), curve("strain, change", 2, energies.strain),
       curve("gravity, change", 6, energies.gravity),
       curve("lost to friction", 1, energies.friction),
       curve("in the normal and tangential element", 3, energies.element)});
}

std::string outcome_of(const PointHistory& history) {
  std::string text = fmt::format("{}; {} elements a link; contact {} \u00b5s", values_of(history),
                                 history.model.elements_per_link,
                                 solver::readable_number(duration_s(history) * kMicro, 5));
  if (history.result) {
    text += fmt::format(", F_n up to {} N, mode {}",
                        solver::readable_number(history.result->fn_peak_N, 5),
                        history.result->major_mode);
  }
  return text;
}

std::string energy_note(const solver::ContactEnergy& energy) {
  // With e* = 1 nothing is lost but what rounding makes of it.
  const double lost_J =
      energy.restitution_J > 1e-12 * energy.exchanged_J ? energy.restitution_J : 0.0;
  return fmt::format(
      "The energy balance closes to {} of what is exchanged in contact; {} J are lost to friction, "
      "{} J in restitution.",
      solver::readable_number(energy.closure, 2), solver::readable_number(energy.friction_J, 4),
      solver::readable_number(lost_J, 4));
}

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

}  // namespace

Panel panel_of(const PointHistory& history, PointPanel panel) {
  switch (panel) {
    case PointPanel::kForces:
      return forces_panel(history);
    case PointPanel::kLoop:
      return loop_panel(history);
    case PointPanel::kDeformation:
      return deformation_panel(history);
    case PointPanel::kVelocities:
      return velocities_panel(history);
    case PointPanel::kEnergies:
      return energies_panel(history);
    case PointPanel::kShape:
      return shape_panel(history);
  }
  return {};
}

std::optional<PointPanel> point_panel_named(const std::string& name) {
  if (name.empty()) {
    return std::nullopt;
  }
  const auto* found = std::find(kPointPanels.begin(), kPointPanels.end(), name);
  if (found == kPointPanels.end()) {
    throw solver::InputError(fmt::format("--panel {} is not known{}: it must be one of {}", name,
                                         protocol::did_you_mean(name, kPointPanels),
                                         protocol::joined(kPointPanels)));
  }
  return static_cast<PointPanel>(found - kPointPanels.begin());
}

Figure point_figure(const PointHistory& history, std::optional<PointPanel> panel) {
  Figure figure{.title = history.name.empty() ? "Impact of the finger" : history.name,
                .subtitle = outcome_of(history)};
  if (panel) {
    figure.panels.push_back(panel_of(history, *panel));
    figure.panels.front().title.clear();
    figure.title += ": " + panel_of(history, *panel).title;
    figure.panel_size = {760.0, 460.0};
  } else {
    figure.columns = 2;
    figure.panel_size = {520.0, 340.0};
    for (std::size_t i = 0; i < kPointPanels.size(); ++i) {
      figure.panels.push_back(panel_of(history, static_cast<PointPanel>(i)));
    }
  }
  const auto shows = [&](PointPanel one) { return !panel || *panel == one; };
  if (shows(PointPanel::kShape) && !shape_note(history).empty()) {
    figure.notes.push_back(shape_note(history));
  }
  if (shows(PointPanel::kEnergies) && history.result) {
    figure.notes.push_back(energy_note(history.result->energy));
  }
  if (shows(PointPanel::kLoop) && history.e_star == 1.0) {
    figure.notes.emplace_back("With e* = 1 restitution follows the line of compression.");
  }
  figure.notes.insert(figure.notes.end(), history.remarks.begin(), history.remarks.end());
  return figure;
}

}  // namespace oblique::client::plot
