#include "client/plot/point/history.h"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/plot/sheets/sheet.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

/// Spans in which `is_inside` holds of the state that begins each row.
template <class Inside>
void add_spans(std::vector<Span>& spans, const PointHistory& history, std::size_t kind,
               const std::string& name, const Inside& is_inside) {
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
      spans.push_back({rows[i].t_s, rows[i + 1].t_s, kind, name});
    }
  }
}

}  // namespace

std::string values_of(const PointHistory& history) {
  return fmt::format("H = {} m, \u03bc = {}, e* = {}", solver::readable_number(history.H_m),
                     solver::readable_number(history.mu), solver::readable_number(history.e_star));
}

std::vector<Span> spans_of(const PointHistory& history) {
  std::vector<Span> spans;
  add_spans(spans, history, kCompressionSpan, "compression",
            [](const std::string& state) { return state.ends_with('C'); });
  add_spans(spans, history, kRestitutionSpan, "restitution",
            [](const std::string& state) { return state.ends_with('R'); });
  add_spans(spans, history, kStickSpan, "stick",
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

}  // namespace oblique::client::plot
