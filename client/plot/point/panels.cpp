#include "client/plot/point/panels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
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

}  // namespace

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

Figure figure_of(const PointHistory& history, PointPanel panel, bool names_spans) {
  Figure figure;
  figure.panels.push_back(panel_of(history, panel));
  for (Span& span : figure.panels.front().spans) {
    span.name = names_spans ? span.name : std::string();
  }
  return figure;
}

Sheet sheet_of(const PointHistory& history, std::optional<PointPanel> panel) {
  Sheet sheet{.title = history.name.empty() ? "Impact of the finger" : history.name,
              .subtitle = outcome_of(history)};
  if (panel) {
    sheet.columns = 1;
    sheet.part = {760.0, 460.0};
    sheet.parts.push_back(figure_of(history, *panel, true));
  } else {
    for (std::size_t i = 0; i < kPointPanels.size(); ++i) {
      sheet.parts.push_back(figure_of(history, static_cast<PointPanel>(i), i == 0));
    }
  }
  const auto shows = [&](PointPanel one) { return !panel || *panel == one; };
  if (shows(PointPanel::kShape) && !shape_note(history).empty()) {
    sheet.notes.push_back(shape_note(history));
  }
  if (shows(PointPanel::kEnergies) && history.result) {
    sheet.notes.push_back(energy_note(history.result->energy));
  }
  if (shows(PointPanel::kLoop) && history.e_star == 1.0) {
    sheet.notes.push_back("With e* = 1 restitution goes back as compression came.");
  }
  sheet.notes.insert(sheet.notes.end(), history.remarks.begin(), history.remarks.end());
  return sheet;
}

}  // namespace oblique::client::plot
