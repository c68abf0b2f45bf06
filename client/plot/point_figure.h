#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/plot/figure.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/trace.h"

namespace oblique::client::plot {

/// Shape of the finger after its tip has dropped by `drop_m`.
struct FallShape {
  double drop_m;
  std::vector<double> nodes_m;  ///< as TraceRow::nodes_m
};

/// One point with its time histories, from touch to separation.
struct PointHistory {
  std::string name;  ///< "Point 3 of paper"; empty: belongs to no study
  solver::ModelParameters model;
  double H_m = 0.0;
  double mu = 0.0;
  double e_star = 0.0;
  std::vector<solver::TraceRow> rows = {};
  std::optional<solver::CaseResult> result = {};  ///< empty if this version cannot read the result
  std::vector<FallShape> falls = {};              ///< some shapes during the fall; may be empty
  std::vector<std::string> remarks = {};          ///< sentences below the picture

  double duration_s() const { return rows.empty() ? 0.0 : rows.back().t_s; }
};

inline constexpr double kMicro = 1e6;

using Column = double solver::TraceRow::*;

/// Returns a curve of column `y` over column `x`.
Curve curve_of(const PointHistory& history, std::string name, std::size_t stroke, Column y,
               Column x = &solver::TraceRow::t_s);

FigureAxis time_axis(double duration_s);

/// Sets the range of an axis to all values of the curves, with a margin.
void fit(FigureAxis& axis, const std::vector<Curve>& curves, std::vector<double> Curve::*values);

enum class PointPanel { kForces, kLoop, kDeformation, kVelocities, kEnergies, kShape };
inline constexpr std::array<std::string_view, 6> kPointPanels{
    "forces", "loop", "deformation", "velocities", "energies", "shape"};

/// Returns the panel called `name`, or nothing (all panels) if `name` is empty. Throws
/// solver::InputError for an unknown name.
std::optional<PointPanel> point_panel_named(const std::string& name);

Panel panel_of(const PointHistory& history, PointPanel panel);

/// Returns a figure of one panel or, without `panel`, of all. The title names the point, the
/// subtitle its values and outcome; the notes state what the picture omits.
Figure point_figure(const PointHistory& history, std::optional<PointPanel> panel);

}  // namespace oblique::client::plot
