#include "client/paper/figures/paper_figures.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/paper/paper_comparison.h"
#include "client/plot/point_figure.h"

namespace oblique::client {
namespace {

using plot::Curve;
using plot::Figure;
using plot::KnownPoint;
using plot::Panel;
using solver::TraceRow;

constexpr const char* kPublished = "published";
constexpr double kKilo = 1e3;
constexpr double kMilli = 1e-3;

using OfRow = std::function<double(const TraceRow&)>;
/// The published numbers of a case, where they are marked.
using KnownOf = std::function<std::vector<KnownPoint>(const PaperCase&)>;

/// What a panel draws of each case of a group.
struct PanelPlan {
  std::string label;
  std::string name;
  double per_unit;
  OfRow value;
  KnownOf known;
};

/// The value between the instants of the trace.
double value_at(const PaperCase& one, double t_s, const OfRow& value) {
  const auto& rows = one.history.rows;
  const auto after =
      std::find_if(rows.begin(), rows.end(), [t_s](const TraceRow& row) { return row.t_s >= t_s; });
  if (after == rows.begin() || after == rows.end()) {
    return after == rows.end() ? value(rows.back()) : value(*after);
  }
  const auto before = after - 1;
  const double share = (t_s - before->t_s) / (after->t_s - before->t_s);
  return value(*before) + share * (value(*after) - value(*before));
}

/// A panel over time with a line a case.
Panel group_panel(const PaperGroup& group, const PanelPlan& plan) {
  Panel panel;
  double longest_s = 0.0;
  std::vector<Curve> all;
  for (std::size_t i = 0; i < group.cases.size(); ++i) {
    const PaperCase& one = group.cases[i];
    longest_s = std::max(longest_s, duration_s(one.history));
    panel.curves.push_back(
        {.name = name_in_group(one, group.key),
         .x = series_of(one.history, [](const TraceRow& row) { return row.t_s; }),
         .y = series_of(one.history, plan.value),
         .stroke = i});
    const auto known = plan.known(one);
    panel.known.insert(panel.known.end(), known.begin(), known.end());
  }
  all = panel.curves;
  for (const KnownPoint& known : panel.known) {
    longest_s = std::max(longest_s, known.x);
    all.push_back({.name = {}, .x = {known.x}, .y = {known.y}});
  }
  panel.x = plot::time_axis(1.03 * longest_s);  // marks at the end are whole
  panel.y = plot::axis_around(plan.label, plan.name, plan.per_unit, all, false);
  return panel;
}

using PanelsOf = std::function<std::vector<Panel>(const PaperGroup&)>;

/// The panels of the groups, lettered as the paper's: the groups of a row beside each other, panels
/// of one group below each other.
Figure figure_of_groups(std::string title, std::size_t columns,
                        const std::vector<const PaperGroup*>& groups, const PanelsOf& panels_of) {
  Figure figure{.title = std::move(title), .columns = columns, .panel_size = {520.0, 340.0}};
  char letter = 'a';
  for (std::size_t first = 0; first < groups.size(); first += columns) {
    std::vector<std::vector<Panel>> parts;
    for (std::size_t i = first; i < std::min(first + columns, groups.size()); ++i) {
      parts.push_back(panels_of(*groups[i]));
      parts.back().front().title = fmt::format("({}) {}", letter++, groups[i]->title);
      for (std::size_t k = 0; k + 1 < parts.back().size(); ++k) {
        parts.back()[k].has_key = false;
        parts.back()[k].x.label.clear();
      }
    }
    for (std::size_t k = 0; k < parts.front().size(); ++k) {
      for (auto& part : parts) {
        figure.panels.push_back(std::move(part[k]));
      }
    }
  }
  return figure;
}

std::vector<const PaperGroup*> all_groups(const PaperGroups& groups) {
  return {&groups.over_H, &groups.over_e, &groups.over_small_mu, &groups.over_large_mu};
}

// ---- What is published ------------------------------------------------------------------------

std::vector<solver::Peak> major_peaks(const PaperCase& one) {
  std::vector<solver::Peak> peaks = one.history.result->peaks;
  std::erase_if(peaks, [](const solver::Peak& peak) { return !peak.major; });
  return peaks;
}

std::vector<KnownPoint> published_fn(const PaperCase& one) {
  std::vector<KnownPoint> known;
  const auto peaks = major_peaks(one);
  for (std::size_t i = 0; i < std::min(peaks.size(), one.published.fn_kN.size()); ++i) {
    known.push_back({peaks[i].t_s, one.published.fn_kN[i] * kKilo, kPublished});
  }
  return known;
}

/// When |F_t| is largest around that peak of F_n.
double instant_of_ft(const PaperCase& one, const solver::Peak& peak) {
  for (const auto& tangential : one.history.result->ft_peaks) {
    if (std::abs(tangential.ft_N - peak.ft_N) <= 1e-9 * peak.ft_N) {
      return tangential.t_s;
    }
  }
  return peak.t_s;
}

std::vector<KnownPoint> published_ft(const PaperCase& one) {
  std::vector<KnownPoint> known;
  const auto peaks = major_peaks(one);
  for (std::size_t i = 0; i < std::min(peaks.size(), one.published.ft_kN.size()); ++i) {
    known.push_back({instant_of_ft(one, peaks[i]), one.published.ft_kN[i] * kKilo, kPublished});
  }
  return known;
}

double normal_deformation(const TraceRow& row) {
  return row.uy_m;
}

/// Where phases end, on our curve at the end of our phase of the same number.
std::vector<KnownPoint> published_ends(const PaperCase& one) {
  std::vector<KnownPoint> known;
  const CaseNumbers own = own_case(*one.history.result);
  double published_s = 0.0;
  double own_s = 0.0;
  for (std::size_t i = 0; i < std::min(own.phases_ms.size(), one.published.phases_ms.size()); ++i) {
    published_s += one.published.phases_ms[i] * kMilli;
    own_s += own.phases_ms[i] * kMilli;
    known.push_back({published_s, value_at(one, own_s, normal_deformation), kPublished});
  }
  return known;
}

std::vector<KnownPoint> published_stick(const PaperCase& one) {
  if (!one.published.stick_ms) {
    return {};
  }
  return {{*one.published.stick_ms * kMilli, 0.0, kPublished}};
}

// ---- The figures ------------------------------------------------------------------------------

/// Panels beside each other have one scale.
void share_axes(std::vector<Panel>& panels) {
  plot::Range x = panels.front().x.range;
  plot::Range y = panels.front().y.range;
  for (const Panel& panel : panels) {
    x = plot::united(x, panel.x.range);
    y = plot::united(y, panel.y.range);
  }
  for (Panel& panel : panels) {
    panel.x.range = x;
    panel.y.range = y;
  }
}

Figure hysteresis(const PaperGroup& over_e) {
  Figure figure{.title = "Fig. 3: normal force against deformation",
                .subtitle =
                    "H = 1 m, \u03bc = 0.4. Slopes are k in compression and k/e*\u00b2 in "
                    "restitution. Diamonds: published peaks, at our deformation",
                .columns = 3,
                .panel_size = {400.0, 360.0}};
  char letter = 'a';
  for (auto one = over_e.cases.rbegin(); one != over_e.cases.rend(); ++one) {
    Panel panel = panel_of(one->history, plot::PointPanel::kLoop);
    panel.title = fmt::format("({}) {}", letter++, name_in_group(*one, over_e.key));
    for (const KnownPoint& known : published_fn(*one)) {
      panel.known.push_back({-value_at(*one, known.x, normal_deformation), known.y, known.name});
    }
    figure.panels.push_back(std::move(panel));
  }
  share_axes(figure.panels);
  return figure;
}

Figure forces(const PaperGroups& groups) {
  Figure figure = figure_of_groups(
      "Fig. 4: normal and tangential contact forces", 2, all_groups(groups),
      [](const PaperGroup& group) {
        return std::vector<Panel>{
            group_panel(group, {"normal force F_n [N]", "fn_N", 1.0,
                                [](const TraceRow& row) { return row.fn_N; }, published_fn}),
            group_panel(group, {"tangential force F_t [N]", "ft_N", 1.0,
                                [](const TraceRow& row) { return row.ft_N; }, published_ft})};
      });
  figure.subtitle = "Diamonds: published peaks (Tab. 2), at the instants of ours";
  figure.panel_size = {520.0, 250.0};
  return figure;
}

Figure deformation(const PaperGroups& groups) {
  Figure figure =
      figure_of_groups("Fig. 5: deformation of the normal element", 2, all_groups(groups),
                       [](const PaperGroup& group) {
                         return std::vector<Panel>{group_panel(
                             group, {"normal deformation u_y [\u00b5m]", "uy_m", plot::kMicro,
                                     normal_deformation, published_ends})};
                       });
  figure.subtitle =
      "Diamonds: published ends of compression and restitution (section 4.2), at our deformation";
  return figure;
}

Figure velocity_of_P(const PaperGroups& groups) {
  Figure figure = figure_of_groups(
      "Fig. 6: tangential velocity of P", 2, all_groups(groups), [](const PaperGroup& group) {
        return std::vector<Panel>{
            group_panel(group, {"velocity of P [m/s]", "vP_m_s", 1.0,
                                [](const TraceRow& row) { return row.vP_m_s; }, published_stick})};
      });
  figure.subtitle = "P sticks where it is 0. Diamonds: published ends of stick (section 4.3)";
  return figure;
}

Figure trajectory(const PaperGroups& groups) {
  Figure figure = figure_of_groups(
      "Fig. 7: path of the fingertip during contact", 3,
      {&groups.over_e, &groups.over_small_mu, &groups.over_large_mu}, [](const PaperGroup& group) {
        Panel panel;
        for (std::size_t i = 0; i < group.cases.size(); ++i) {
          const auto& one = group.cases[i];
          panel.curves.push_back(
              {.name = name_in_group(one, group.key),
               .x = series_of(one.history, [](const TraceRow& row) { return row.x_m; }),
               .y = series_of(one.history, normal_deformation),
               .stroke = i});
        }
        panel.x = plot::axis_around("position x [mm]", "x_m", kKilo, panel.curves, true);
        panel.y = plot::axis_around("height above the ground [\u00b5m]", "height_m", plot::kMicro,
                                    panel.curves, false);
        return std::vector<Panel>{std::move(panel)};
      });
  figure.subtitle = "The tip touches at the right, and slides to the left";
  figure.panel_size = {400.0, 360.0};
  return figure;
}

}  // namespace

std::vector<PaperFigure> paper_figures(const PaperGroups& groups) {
  return {{"fig3_hysteresis", hysteresis(groups.over_e)},
          {"fig4_forces", forces(groups)},
          {"fig5_deformation", deformation(groups)},
          {"fig6_velocity_of_P", velocity_of_P(groups)},
          {"fig7_trajectory", trajectory(groups)}};
}

}  // namespace oblique::client
