#include "client/paper/paper_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <tuple>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/case_result.h"

namespace oblique::client {
namespace {

using plot::Curve;
using plot::Figure;
using plot::Panel;
using solver::TraceRow;

constexpr double kFromKilo = 1e3;
constexpr double kFromMilli = 1e-3;

PaperCase solved_case(const PublishedCase& published, const solver::Finger& finger) {
  PaperCase one{.published = published,
                .history = {.name = {},
                            .model = finger.model(),
                            .H_m = published.H_m,
                            .mu = published.mu,
                            .e_star = published.e_star},
                .name = {}};
  auto& rows = one.history.rows;
  one.history.result = finger.solve(published.H_m, published.mu, published.e_star,
                                    {[&rows](const TraceRow& row) { rows.push_back(row); }, false});
  return one;
}

/// Interpolates a column linearly between instants of the trace.
double value_at(const PaperCase& one, double t_s, plot::Column value) {
  const auto& rows = one.history.rows;
  const auto after =
      std::find_if(rows.begin(), rows.end(), [t_s](const TraceRow& row) { return row.t_s >= t_s; });
  if (after == rows.begin() || after == rows.end()) {
    return after == rows.end() ? rows.back().*value : (*after).*value;
  }
  const TraceRow& before = *(after - 1);
  const double share = (t_s - before.t_s) / (after->t_s - before.t_s);
  return before.*value + share * ((*after).*value - before.*value);
}

/// Adds the published numbers of a case to a curve, which draws them as diamonds.
using AddPublished = std::function<void(const PaperCase& one, Curve& diamonds)>;

/// Adds the published peaks of F_n or of F_t. Their times are those of our peaks, because the paper
/// gives none. A peak of F_t is placed at our largest |F_t| near a peak of F_n.
void add_peaks(bool of_ft, const PaperCase& one, Curve& diamonds) {
  const auto& published = of_ft ? one.published.ft_kN : one.published.fn_kN;
  std::size_t next = 0;
  for (const solver::Peak& peak : one.history.result->peaks) {
    if (!peak.major || next == published.size()) {
      continue;
    }
    double t_s = peak.t_s;
    for (const auto& tangential : one.history.result->ft_peaks) {
      const bool is_around = std::abs(tangential.ft_N - peak.ft_N) <= 1e-9 * peak.ft_N;
      t_s = of_ft && is_around ? tangential.t_s : t_s;
    }
    diamonds.x.push_back(t_s);
    diamonds.y.push_back(published[next++] * kFromKilo);
  }
}

/// Adds a diamond for each published end of a phase, on our curve at the end of the same phase.
void add_phase_ends(const PaperCase& one, Curve& diamonds) {
  const CaseNumbers own = own_case(*one.history.result);
  double published_s = 0.0;
  double own_s = 0.0;
  for (std::size_t i = 0; i < std::min(own.phases_ms.size(), one.published.phases_ms.size()); ++i) {
    published_s += one.published.phases_ms[i] * kFromMilli;
    own_s += own.phases_ms[i] * kFromMilli;
    diamonds.x.push_back(published_s);
    diamonds.y.push_back(value_at(one, own_s, &TraceRow::uy_m));
  }
}

void add_stick_end(const PaperCase& one, Curve& diamonds) {
  if (one.published.stick_ms) {
    diamonds.x.push_back(*one.published.stick_ms * kFromMilli);
    diamonds.y.push_back(0.0);
  }
}

Curve diamonds() {
  return {.name = "published", .stroke = 7, .mark = Curve::Mark::kDiamonds};
}

void add_if_any(Panel& panel, Curve curve) {
  if (!curve.x.empty()) {
    panel.curves.push_back(std::move(curve));
  }
}

/// Content of a panel: one column over time, for each case of a group.
struct PanelPlan {
  std::string label;
  std::string name;
  double per_unit;
  plot::Column column;
  AddPublished add_published;
};

Panel group_panel(const PaperGroup& group, const PanelPlan& plan) {
  Panel panel;
  Curve published = diamonds();
  double longest_s = 0.0;
  for (const PaperCase& one : group.cases) {
    panel.curves.push_back(curve_of(one.history, one.name, panel.curves.size(), plan.column));
    plan.add_published(one, published);
    longest_s = std::max(longest_s, one.history.duration_s());
  }
  for (const double t_s : published.x) {
    longest_s = std::max(longest_s, t_s);
  }
  add_if_any(panel, std::move(published));
  panel.x = plot::time_axis(1.03 * longest_s);  // leaves room for a diamond at a curve's end
  panel.y = {.label = plan.label, .name = plan.name, .per_unit = plan.per_unit};
  plot::fit(panel.y, panel.curves, &Curve::y);
  return panel;
}

/// Creates a figure: a column of panels per group, two groups per row, lettered as in the paper.
Figure over_time(const PaperGroups& groups, const std::string& title, const std::string& subtitle,
                 double panel_height, const std::vector<PanelPlan>& plans) {
  Figure figure{
      .title = title, .subtitle = subtitle, .columns = 2, .panel_size = {520.0, panel_height}};
  for (std::size_t first = 0; first < groups.size(); first += 2) {
    for (const PanelPlan& plan : plans) {
      for (std::size_t i = first; i < first + 2; ++i) {
        Panel panel = group_panel(groups[i], plan);
        if (&plan == &plans.front()) {
          panel.title = fmt::format("({}) {}", static_cast<char>('a' + i), groups[i].title);
        }
        if (&plan != &plans.back()) {
          panel.has_key = false;
          panel.x.label.clear();
        }
        figure.panels.push_back(std::move(panel));
      }
    }
  }
  return figure;
}

/// Creates one panel with the hysteresis loops for all e*.
Figure hysteresis(const PaperGroup& over_e) {
  Figure figure{.title = "Fig. 3: normal force against deformation",
                .subtitle =
                    "H = 1 m, \u03bc = 0.4. Slopes are k in compression and k/e*\u00b2 in "
                    "restitution. Diamonds: published peaks at our deformation",
                .columns = 3,
                .panel_size = {400.0, 360.0}};
  plot::Range x{0.0, 0.0};
  plot::Range y{0.0, 0.0};
  for (auto one = over_e.cases.rbegin(); one != over_e.cases.rend(); ++one) {
    Panel panel = panel_of(one->history, plot::PointPanel::kLoop);
    const auto letter = static_cast<char>('a' + figure.panels.size());
    panel.title = fmt::format("({}) {}", letter, one->name);
    Curve published = diamonds();
    add_peaks(false, *one, published);
    for (double& at : published.x) {
      at = -value_at(*one, at, &TraceRow::uy_m);
    }
    add_if_any(panel, std::move(published));
    x = plot::united(x, panel.x.range);
    y = plot::united(y, panel.y.range);
    figure.panels.push_back(std::move(panel));
  }
  for (Panel& panel : figure.panels) {
    panel.x.range = x;
    panel.y.range = y;
  }
  return figure;
}

/// Creates panels with the paths of the tip. The paper has no such panel for its group in which H
/// varies.
Figure trajectory(const PaperGroups& groups) {
  Figure figure{.title = "Fig. 7: path of the fingertip during contact",
                .subtitle = "The tip touches on the right and slides to the left",
                .columns = 3,
                .panel_size = {400.0, 360.0}};
  for (std::size_t i = 1; i < groups.size(); ++i) {
    Panel panel;
    panel.title = fmt::format("({}) {}", static_cast<char>('a' + i - 1), groups[i].title);
    for (const PaperCase& one : groups[i].cases) {
      panel.curves.push_back(
          curve_of(one.history, one.name, panel.curves.size(), &TraceRow::uy_m, &TraceRow::x_m));
    }
    panel.x = {.label = "position x [mm]", .name = "x_m", .per_unit = 1e3};
    panel.y = {
        .label = "height above the ground [\u00b5m]", .name = "height_m", .per_unit = plot::kMicro};
    plot::fit(panel.x, panel.curves, &Curve::x);
    plot::fit(panel.y, panel.curves, &Curve::y);
    figure.panels.push_back(std::move(panel));
  }
  return figure;
}

}  // namespace

PaperGroups solved_groups(const PublishedTable& table, const solver::Finger& finger) {
  std::vector<PaperCase> all;
  for (const auto& published : table.cases) {
    all.push_back(solved_case(published, finger));
  }
  const auto group = [&all](std::string title, const std::string& name, std::size_t varies,
                            const std::vector<std::array<double, 3>>& members) {
    PaperGroup made{std::move(title), {}};
    for (const auto& values : members) {
      const auto found = std::find_if(all.begin(), all.end(), [&values](const PaperCase& one) {
        return one.published.is_at(values[0], values[1], values[2]);
      });
      if (found == all.end()) {
        throw std::runtime_error(
            fmt::format("the published table lacks {}", fmt::join(values, ", ")));
      }
      made.cases.push_back(*found);
      made.cases.back().name = fmt::format(fmt::runtime(name), values[varies]);
    }
    return made;
  };
  return {group("drop H (\u03bc = 0.4, e* = 1)", "H = {} m", 0,
                {{0.96, 0.4, 1.0}, {1.0, 0.4, 1.0}, {1.04, 0.4, 1.0}}),
          group("restitution e* (H = 1 m, \u03bc = 0.4)", "e* = {}", 2,
                {{1.0, 0.4, 0.6}, {1.0, 0.4, 0.8}, {1.0, 0.4, 1.0}}),
          group("friction \u03bc, small (H = 1 m, e* = 1)", "\u03bc = {}", 1,
                {{1.0, 0.4, 1.0}, {1.0, 0.6, 1.0}, {1.0, 0.8, 1.0}}),
          group("friction \u03bc, large (H = 1 m, e* = 1)", "\u03bc = {}", 1,
                {{1.0, 1.2, 1.0}, {1.0, 1.4, 1.0}, {1.0, 1.6, 1.0}})};
}

std::vector<PaperFigure> paper_figures(const PaperGroups& groups) {
  return {{"fig3_hysteresis", hysteresis(groups[1])},
          {"fig4_forces", over_time(groups, "Fig. 4: normal and tangential contact forces",
                                    "Diamonds: published peaks (Tab. 2) at our instants", 250.0,
                                    {{"normal force F_n [N]", "fn_N", 1.0, &TraceRow::fn_N,
                                      std::bind_front(add_peaks, false)},
                                     {"tangential force F_t [N]", "ft_N", 1.0, &TraceRow::ft_N,
                                      std::bind_front(add_peaks, true)}})},
          {"fig5_deformation", over_time(groups, "Fig. 5: deformation of the normal element",
                                         "Diamonds: published ends of compression and restitution "
                                         "(section 4.2) at our deformation",
                                         340.0,
                                         {{"normal deformation u_y [\u00b5m]", "uy_m", plot::kMicro,
                                           &TraceRow::uy_m, add_phase_ends}})},
          {"fig6_velocity_of_P",
           over_time(
               groups, "Fig. 6: tangential velocity of P",
               "P sticks where the velocity is 0. Diamonds: published ends of stick (section 4.3)",
               340.0, {{"velocity of P [m/s]", "vP_m_s", 1.0, &TraceRow::vP_m_s, add_stick_end}})},
          {"fig7_trajectory", trajectory(groups)}};
}

}  // namespace oblique::client
