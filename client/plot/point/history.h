#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/plot/figures/figure.h"
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

/// "H = 1 m, mu = 0.4, e* = 1" with Greek letters.
std::string values_of(const PointHistory& history);

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

/// An axis that has all values of the panel's curves and known points, and a little more.
FigureAxis axis_around(std::string label, std::string name, double per_unit,
                       const std::vector<Curve>& curves, bool of_x);

}  // namespace oblique::client::plot
