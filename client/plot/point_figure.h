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
};

inline constexpr double kMicro = 1e6;

/// Compression and restitution, and over them stick, as spans of time.
std::vector<Span> spans_of(const PointHistory& history);

/// What `of` gives of each row.
template <class Of>
std::vector<double> series_of(const PointHistory& history, const Of& of) {
  std::vector<double> values;
  values.reserve(history.rows.size());
  for (const auto& row : history.rows) {
    values.push_back(of(row));
  }
  return values;
}

/// The time axis, from touch to separation [us].
FigureAxis time_axis(double duration_s);
double duration_s(const PointHistory& history);

/// An axis that has all values of the panel's curves, and a little more.
FigureAxis axis_around(std::string label, std::string name, double per_unit,
                       const std::vector<Curve>& curves, bool of_x);

/// What pictures of a point show.
enum class PointPanel { kForces, kLoop, kDeformation, kVelocities, kEnergies, kShape };
inline constexpr std::array<std::string_view, 6> kPointPanels{
    "forces", "loop", "deformation", "velocities", "energies", "shape"};

/// The panels of that name; empty: none, for all. Throws solver::InputError for another name.
std::optional<PointPanel> point_panel_named(const std::string& name);

Panel panel_of(const PointHistory& history, PointPanel panel);

/// One panel, or all. Its title is the point, its subtitle its values and outcome, its notes what
/// cannot be seen in it.
Figure point_figure(const PointHistory& history, std::optional<PointPanel> panel);

/// What became of the energy that the finger gives to the contact, from touch on [J]. Sums of
/// trapezia over the positions of tip and P: exact for the normal element and while P sticks.
struct EnergyHistory {
  std::vector<double> kinetic;   ///< change
  std::vector<double> strain;    ///< change
  std::vector<double> gravity;   ///< change
  std::vector<double> friction;  ///< lost at P
  std::vector<double> element;   ///< stored in the contact, and lost in its restitution
};
EnergyHistory energies_of(const PointHistory& history);

}  // namespace oblique::client::plot
