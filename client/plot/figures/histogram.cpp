#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/plot/figures/charts.h"

namespace oblique::client::plot {
namespace {

constexpr int kMostBins = 100;
constexpr std::size_t kMostNames = 16;

/// Distance of the quartiles, of values in any order.
double between_quartiles(std::vector<double> values) {
  const auto quartile = [&values](std::size_t quarters) {
    const auto at =
        values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * quarters / 4);
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  return quartile(3) - quartile(1);
}

/// How many bins to aim at: of 2 IQR / n^(1/3) each, as Freedman and Diaconis have it.
int bins_for(const std::vector<double>& places, const Scale& scale) {
  if (places.size() < 2) {
    return 1;
  }
  std::vector<double> shares;
  shares.reserve(places.size());
  for (const double value : places) {
    shares.push_back(scale.share_of(value));
  }
  const double width = 2.0 * between_quartiles(std::move(shares)) /
                       std::pow(static_cast<double>(places.size()), 1.0 / 3.0);
  constexpr double kFewest = 10.0;
  return static_cast<int>(
      std::clamp(width > 0.0 ? std::ceil(1.0 / width) : kFewest, kFewest, 1.0 * kMostBins));
}

/// number * step of a step that is 1, 2 or 5 times a power of ten: the double that people write.
double multiple(double number, double step) {
  return step < 1.0 ? number / std::round(1.0 / step) : number * step;
}

/// Edges at round values, from below the smallest to above the largest; on a logarithmic scale
/// equal ratios.
std::vector<double> edges_for(const Scale& scale, int bins) {
  std::vector<double> edges;
  if (scale.is_logarithmic()) {
    for (int i = 0; i <= bins; ++i) {
      edges.push_back(scale.value_at(static_cast<double>(i) / bins));
    }
    return edges;
  }
  const Ticks ticks = ticks_of(scale, bins);
  if (ticks.ticks.size() < 2) {
    return {scale.from(), scale.to()};
  }
  const double step = ticks.ticks[1].value - ticks.ticks[0].value;
  const double first = std::floor(scale.from() / step + 1e-9);
  for (int i = 0; i <= 2 * kMostBins; ++i) {
    edges.push_back(multiple(first + i, step));
    if (edges.back() > scale.to()) {
      break;
    }
  }
  return edges;
}

std::vector<double> drawable(const std::vector<double>& values, bool is_logarithmic,
                             const std::optional<Range>& range) {
  std::vector<double> kept;
  kept.reserve(values.size());
  for (const double value : values) {
    const bool is_in = !range || (value >= range->from && value <= range->to);
    if (std::isfinite(value) && (!is_logarithmic || value > 0.0) && is_in) {
      kept.push_back(value);
    }
  }
  return kept;
}

void say_left_out(Figure& figure, std::size_t all, std::size_t kept) {
  if (kept < all) {
    figure.notes.push_back(fmt::format("{} of {} points have no value, or one outside the axis.",
                                       shown_count(all - kept), shown_count(all)));
  }
  if (kept == 0) {
    say_empty(figure, "no point has a value");
  }
}

}  // namespace

Figure histogram(const Quantity& quantity, const std::vector<double>& values,
                 const ChartChoice& choice) {
  const bool is_logarithmic = choice.is_x_logarithmic;
  const auto kept = drawable(values, is_logarithmic, choice.range);
  const Range range = choice.range ? *choice.range : range_of(kept, is_logarithmic);
  const Scale scale(range.from, range.to, is_logarithmic);
  Bars bars;
  bars.edges = edges_for(scale, bins_for(kept, scale));
  bars.heights.assign(bars.edges.size() - 1, 0.0);
  for (const double value : kept) {
    const auto above = std::upper_bound(bars.edges.begin(), bars.edges.end(), value);
    const auto bin = std::clamp<std::ptrdiff_t>(
        above - bars.edges.begin() - 1, 0, static_cast<std::ptrdiff_t>(bars.heights.size()) - 1);
    bars.heights[static_cast<std::size_t>(bin)] += 1.0;
  }
  Figure figure;
  Panel panel;
  panel.x = axis_of(quantity, {bars.edges.front(), bars.edges.back()}, is_logarithmic);
  const double tallest = range_of(bars.heights).to;
  const bool is_y_logarithmic = choice.is_y_logarithmic && tallest >= 1.0;
  panel.y = {"points", "points",
             is_y_logarithmic ? Range{0.5, std::max(tallest * 1.5, 1.5)}
                              : Range{0.0, std::max(tallest * 1.05, 1.0)},
             is_y_logarithmic};
  panel.y.is_whole = true;
  panel.bars = std::move(bars);
  figure.panels.push_back(std::move(panel));
  say_left_out(figure, values.size(), kept.size());
  return figure;
}

Figure name_counts(const Quantity& quantity, const std::vector<std::string>& names,
                   const std::vector<std::uint64_t>& counts) {
  std::vector<std::pair<std::uint64_t, std::string>> all;
  for (std::size_t i = 0; i < names.size(); ++i) {
    all.emplace_back(counts[i], names[i]);
  }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  Figure figure;
  Panel panel;
  Bars bars;
  const std::size_t kept = all.size() <= kMostNames ? all.size() : kMostNames - 1;
  for (std::size_t i = 0; i < kept; ++i) {
    bars.names.push_back(all[i].second);
    bars.heights.push_back(static_cast<double>(all[i].first));
  }
  if (kept < all.size()) {
    std::uint64_t rest = 0;
    for (std::size_t i = kept; i < all.size(); ++i) {
      rest += all[i].first;
    }
    bars.names.push_back(fmt::format("other: {}", all.size() - kept));
    bars.heights.push_back(static_cast<double>(rest));
  }
  const double tallest = range_of(bars.heights).to;
  panel.x = {"points", "points", {0.0, std::max(tallest * 1.05, 1.0)}, false};
  panel.y = {quantity.label,
             quantity.name,
             {0.0, std::max<double>(1.0, static_cast<double>(bars.names.size()))},
             false};
  panel.x.is_whole = true;
  if (bars.names.empty()) {
    say_empty(figure, "no point has a value");
  } else {
    panel.bars = std::move(bars);
  }
  figure.panels.push_back(std::move(panel));
  return figure;
}

}  // namespace oblique::client::plot
