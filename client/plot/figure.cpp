#include "client/plot/figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/query/columns.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client::plot {
namespace {

/// A range around one value.
Range around(double value, bool is_logarithmic) {
  const double half = value == 0.0 ? 0.5 : 0.1 * std::abs(value);
  return is_logarithmic ? Range{value / 1.25, value * 1.25} : Range{value - half, value + half};
}

/// The symbol of a quantity with its name, else the first words of what a column means, else its
/// name.
std::string label_of(const std::string& name) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kSymbols{{
      {"H", "drop H"},
      {"mu", "coefficient of friction \u03bc"},
      {"e", "coefficient of restitution e*"},
      {"eta2", "stiffness ratio \u03b7\u00b2"},
  }};
  for (const auto& [symbol, label] : kSymbols) {
    if (symbol == name) {
      return std::string(label);
    }
  }
  constexpr std::size_t kLongest = 60;
  for (const auto& column : server::columns_and_functions()) {
    const std::string words = column.meaning.substr(0, column.meaning.find_first_of(",;:("));
    if (column.name == name && !words.empty() && words.size() <= kLongest) {
      return words.substr(0, words.find_last_not_of(' ') + 1);
    }
  }
  return name;
}

}  // namespace

Range range_of(const std::vector<double>& values, bool positive_only) {
  Range range{INFINITY, -INFINITY};
  for (const double value : values) {
    if (std::isfinite(value) && (!positive_only || value > 0.0)) {
      range = united(range, {value, value});
    }
  }
  return range.from <= range.to ? range : Range{positive_only ? 0.1 : 0.0, 1.0};
}

Range united(const Range& one, const Range& other) {
  return {std::min(one.from, other.from), std::max(one.to, other.to)};
}

void FigureAxis::span(const Range& values, double wider_by) {
  range = values.from < values.to ? values : around(values.from, is_logarithmic);
  const Range narrow = range;
  range = {value_at(-wider_by), value_at(1.0 + wider_by)};
  if (!is_logarithmic && wider_by > 0.0) {
    range.from = narrow.from * range.from < 0.0 ? 0.0 : range.from;
    range.to = narrow.to * range.to < 0.0 ? 0.0 : range.to;
  }
}

double FigureAxis::share_of(double value) const {
  if (!is_logarithmic) {
    return (value - range.from) / (range.to - range.from);
  }
  return value > 0.0 ? std::log(value / range.from) / std::log(range.to / range.from)
                     : std::nan("");
}

double FigureAxis::value_at(double share) const {
  if (share == 0.0 || share == 1.0) {
    return share == 0.0 ? range.from : range.to;
  }
  return is_logarithmic ? range.from * std::pow(range.to / range.from, share)
                        : range.from + share * (range.to - range.from);
}

FigureAxis axis_of(const std::string& name, const std::string& unit) {
  const auto* field = solver::find_result_column(name);
  FigureAxis axis{.label = label_of(name), .name = name};
  std::string shown_unit = unit;
  if (field != nullptr && field->shown_per_unit != 1.0) {
    axis.per_unit = field->shown_per_unit;
    shown_unit = field->shown_unit == "us" ? "\u00b5s" : std::string(field->shown_unit);
  }
  axis.label += shown_unit.empty() ? "" : fmt::format(" [{}]", shown_unit);
  return axis;
}

std::string shown_value(const FigureAxis& axis, double value) {
  std::string text =
      fmt::format("{} = {}", axis.name, solver::readable_number(value * axis.per_unit));
  const auto bracket = axis.label.rfind(" [");
  if (bracket != std::string::npos) {
    text += ' ' + axis.label.substr(bracket + 2, axis.label.size() - bracket - 3);
  }
  return text;
}

std::uint64_t Cells::count(CellState state) const {
  return static_cast<std::uint64_t>(std::count(states.begin(), states.end(), state));
}

std::vector<double> edges_between(const std::vector<double>& values, bool is_logarithmic) {
  if (values.size() < 2) {
    const Range room = around(values.empty() ? 0.0 : values.front(), is_logarithmic);
    return values.empty() ? std::vector<double>{} : std::vector<double>{room.from, room.to};
  }
  std::vector<double> edges{0.0};
  for (std::size_t i = 1; i < values.size(); ++i) {
    edges.push_back(is_logarithmic ? std::sqrt(values[i - 1]) * std::sqrt(values[i])
                                   : 0.5 * (values[i - 1] + values[i]));
  }
  // The outer cells reach as far outwards as inwards.
  const auto mirrored = [is_logarithmic](double end, double inner) {
    return is_logarithmic ? end / inner * end : end + (end - inner);
  };
  edges.front() = mirrored(values.front(), edges[1]);
  edges.push_back(mirrored(values.back(), edges.back()));
  return edges;
}

std::size_t interval_of(const std::vector<double>& edges, double value) {
  if (edges.size() < 2 || !(value >= edges.front() && value <= edges.back())) {
    return SIZE_MAX;
  }
  const auto above = std::upper_bound(edges.begin() + 1, edges.end() - 1, value);
  return static_cast<std::size_t>(above - edges.begin()) - 1;
}

}  // namespace oblique::client::plot
