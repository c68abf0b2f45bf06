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

/// Where the finger is when its tip has dropped so far.
struct FallShape {
  double drop_m;
  std::vector<double> nodes_m;  ///< as TraceRow::nodes_m
};

/// A point with its time histories, from touch to separation.
struct PointHistory {
  std::string name;  ///< "Point 3 of paper"; empty: of no study
  solver::ModelParameters model;
  double H_m = 0.0;
  double mu = 0.0;
  double e_star = 0.0;
  std::vector<solver::TraceRow> rows = {};
  std::optional<solver::CaseResult> result = {};  ///< none: it has outputs unknown here
  std::vector<FallShape> falls = {};              ///< some of the fall, where they are known
  std::vector<std::string> remarks = {};          ///< sentences that the picture has below it

  double duration_s() const { return rows.empty() ? 0.0 : rows.back().t_s; }
};

inline constexpr double kMicro = 1e6;

/// A column of the time histories.
using Column = double solver::TraceRow::*;

/// A line of one column over another.
Curve curve_of(const PointHistory& history, std::string name, std::size_t stroke, Column y,
               Column x = &solver::TraceRow::t_s);

/// The time axis, from touch on.
FigureAxis time_axis(double duration_s);

/// Sets the range of an axis: all values of the curves, and a little more.
void fit(FigureAxis& axis, const std::vector<Curve>& curves, std::vector<double> Curve::*values);

/// What pictures of a point show.
enum class PointPanel { kForces, kLoop, kDeformation, kVelocities, kEnergies, kShape };
inline constexpr std::array<std::string_view, 6> kPointPanels{
    "forces", "loop", "deformation", "velocities", "energies", "shape"};

/// The panel of that name; none for an empty one, that is all. Throws solver::InputError for
/// another name.
std::optional<PointPanel> point_panel_named(const std::string& name);

Panel panel_of(const PointHistory& history, PointPanel panel);

/// One panel, or all. Its title is the point, its subtitle its values and outcome, its notes what
/// cannot be seen in it.
Figure point_figure(const PointHistory& history, std::optional<PointPanel> panel);

}  // namespace oblique::client::plot
