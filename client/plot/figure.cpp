#include "client/plot/figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "server/query/columns.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client::plot {
namespace {

double middle_of(double a, double b, bool is_logarithmic) {
  return is_logarithmic ? std::sqrt(a) * std::sqrt(b) : 0.5 * (a + b);
}

struct Symbol {
  std::string_view name;
  std::string_view label;
};
// Quantities with a symbol; others are labelled by what `oblique columns` says of them.
constexpr std::array<Symbol, 9> kSymbols{{
    {"H", "drop H"},
    {"mu", "coefficient of friction \u03bc"},
    {"e", "coefficient of restitution e*"},
    {"E_Pa", "Young's modulus E"},
    {"A", "cross-section area A"},
    {"I", "second moment of area I"},
    {"rho", "density \u03c1"},
    {"k", "contact stiffness k"},
    {"eta2", "stiffness ratio \u03b7\u00b2"},
}};

/// The first words of what a column means, or else its name.
std::string label_of(const std::string& name) {
  const auto* symbol = std::find_if(kSymbols.begin(), kSymbols.end(),
                                    [&name](const Symbol& each) { return each.name == name; });
  if (symbol != kSymbols.end()) {
    return std::string(symbol->label);
  }
  for (const auto& column : server::columns_and_functions()) {
    if (column.name == name) {
      const std::string words(column.meaning.substr(0, column.meaning.find_first_of(",;:(")));
      constexpr std::size_t kLongest = 60;
      return words.empty() || words.size() > kLongest
                 ? name
                 : words.substr(0, words.find_last_not_of(' ') + 1);
    }
  }
  return name;
}

}  // namespace

Range range_of(const std::vector<double>& values, bool positive_only) {
  Range range{0.0, -1.0};
  for (const double value : values) {
    if (!std::isfinite(value) || (positive_only && value <= 0.0)) {
      continue;
    }
    range = range.to < range.from ? Range{value, value} : united(range, {value, value});
  }
  if (range.to < range.from) {
    return {positive_only ? 0.1 : 0.0, 1.0};
  }
  return range;
}

Range united(const Range& one, const Range& other) {
  return {std::min(one.from, other.from), std::max(one.to, other.to)};
}

Range widened(const Range& range, double by_share, bool is_logarithmic) {
  if (is_logarithmic) {
    const double ratio = std::pow(range.to / range.from, by_share);
    return {range.from / ratio, range.to * ratio};
  }
  const double more = (range.to - range.from) * by_share;
  const auto kept = [](double end, double moved) { return end * moved < 0.0 ? 0.0 : moved; };
  return {kept(range.from, range.from - more), kept(range.to, range.to + more)};
}

Scale::Scale(Range range, bool is_logarithmic) : range_(range), is_logarithmic_(is_logarithmic) {
  if (is_logarithmic && !(range.from > 0.0 && range.to > 0.0)) {
    throw std::invalid_argument("a logarithmic scale needs positive ends");
  }
  if (!(range.from < range.to)) {
    const auto edges = edges_between({range.from}, is_logarithmic);
    range_ = {edges[0], edges[1]};
  }
}

double Scale::share_of(double value) const {
  if (!is_logarithmic_) {
    return (value - range_.from) / (range_.to - range_.from);
  }
  return value > 0.0 ? std::log(value / range_.from) / std::log(range_.to / range_.from)
                     : std::nan("");
}

double Scale::value_at(double share) const {
  if (share == 0.0 || share == 1.0) {
    return share == 0.0 ? range_.from : range_.to;
  }
  return is_logarithmic_ ? range_.from * std::pow(range_.to / range_.from, share)
                         : range_.from + share * (range_.to - range_.from);
}

std::vector<double> Scale::edges(std::size_t cells) const {
  std::vector<double> edges;
  for (std::size_t i = 0; i <= cells; ++i) {
    edges.push_back(value_at(static_cast<double>(i) / static_cast<double>(cells)));
  }
  return edges;
}

FigureAxis axis_of(const std::string& name, const std::string& unit) {
  const auto* field = solver::find_result_column(name);
  const bool has_own_unit = field != nullptr && field->shown_per_unit != 1.0;
  FigureAxis axis{.label = label_of(name), .name = name};
  std::string shown_unit = unit;
  if (has_own_unit) {
    axis.per_unit = field->shown_per_unit;
    shown_unit = field->shown_unit == "us" ? "\u00b5s" : std::string(field->shown_unit);
  }
  if (!shown_unit.empty()) {
    axis.label += fmt::format(" [{}]", shown_unit);
  }
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

void note_empty(Figure& figure, const std::string& why) {
  figure.is_empty = true;
  figure.notes.push_back("Nothing to draw: " + why + ".");
}

std::vector<double> middles_of(const std::vector<double>& edges, bool is_logarithmic) {
  std::vector<double> middles;
  for (std::size_t i = 1; i < edges.size(); ++i) {
    middles.push_back(middle_of(edges[i - 1], edges[i], is_logarithmic));
  }
  return middles;
}

std::vector<double> edges_between(const std::vector<double>& values, bool is_logarithmic) {
  if (values.empty()) {
    return {};
  }
  const std::size_t last = values.size() - 1;
  if (last == 0) {
    const double v = values.front();
    const double half = v == 0.0 ? 0.5 : 0.1 * std::abs(v);
    return is_logarithmic ? std::vector<double>{v / 1.25, v * 1.25}
                          : std::vector<double>{v - half, v + half};
  }
  // The outer cells reach as far outwards as inwards.
  const auto mirrored = [is_logarithmic](double end, double inner) {
    return is_logarithmic ? end / inner * end : end + (end - inner);
  };
  std::vector<double> edges(values.size() + 1);
  for (std::size_t i = 1; i <= last; ++i) {
    edges[i] = middle_of(values[i - 1], values[i], is_logarithmic);
  }
  edges.front() = mirrored(values.front(), edges[1]);
  edges.back() = mirrored(values.back(), edges[last]);
  return edges;
}

}  // namespace oblique::client::plot
