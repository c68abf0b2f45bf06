#include "client/plot/figures/maps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"

namespace oblique::client::plot {
namespace {

Panel panel_of(const MapAxes& axes, const Cells& cells) {
  const auto ends = [](const std::vector<double>& edges) {
    return edges.empty() ? Range{0.0, 1.0} : Range{edges.front(), edges.back()};
  };
  Panel panel;
  panel.x = axis_of(axes.x, ends(cells.x_edges), axes.is_x_logarithmic);
  panel.y = axis_of(axes.y, ends(cells.y_edges), axes.is_y_logarithmic);
  return panel;
}

void say_no_value(Figure& figure) {
  if (figure.gaps.no_value > 0) {
    figure.notes.push_back(fmt::format(
        "{} {} blank: solved, but without a value that can be drawn.",
        shown_count(figure.gaps.no_value), figure.gaps.no_value == 1 ? "cell is" : "cells are"));
  }
}

/// The kinds by the number of their cells, largest first, those with next to none gathered in the
/// last one.
std::vector<Kind> gathered(const std::map<std::string, std::uint64_t>& cells,
                           const std::string& plural) {
  std::vector<Kind> kinds;
  std::uint64_t whole = 0;
  for (const auto& [name, count] : cells) {
    kinds.push_back({.name = name, .cells = count});
    whole += count;
  }
  std::stable_sort(kinds.begin(), kinds.end(),
                   [](const Kind& a, const Kind& b) { return a.cells > b.cells; });
  std::size_t kept = kinds.size();
  if (kept > kMostKinds) {
    // A kind that has less than a quarter of a per cent is nowhere to be seen.
    kept = kMostKinds;
    while (kept > 1 && kinds[kept - 1].cells * 400 < whole) {
      --kept;
    }
  }
  if (kept == kinds.size()) {
    return kinds;
  }
  Kind rest{.name = {}, .is_rest = true};
  for (std::size_t i = kept; i < kinds.size(); ++i) {
    rest.cells += kinds[i].cells;
    rest.gathered.push_back(kinds[i].name);
  }
  rest.name = fmt::format("other: {} {}", rest.gathered.size(), plural);
  kinds.resize(kept);
  kinds.push_back(std::move(rest));
  return kinds;
}

}  // namespace

Colours colours_for(const Quantity& quantity, const std::vector<double>& values,
                    const ColourChoice& choice) {
  const Range all = range_of(values, choice.is_logarithmic);
  const Scale scale(choice.range ? choice.range->from : all.from,
                    choice.range ? choice.range->to : all.to, choice.is_logarithmic);
  Colours colours{axis_of(quantity, {scale.from(), scale.to()}, choice.is_logarithmic),
                  choice.palette};
  colours.has_below = all.from < scale.from();
  colours.has_above = all.to > scale.to();
  return colours;
}

Figure heat_map(const MapAxes& axes, const Quantity& value, Cells cells,
                const ColourChoice& choice) {
  for (std::size_t i = 0; i < cells.values.size(); ++i) {
    const double at = cells.values[i];
    const bool has_place = std::isfinite(at) && (!choice.is_logarithmic || at > 0.0);
    if (cells.states[i] == CellState::kSolved && !has_place) {
      cells.states[i] = CellState::kNoValue;
    }
  }
  Figure figure;
  figure.gaps = gaps_of(cells);
  std::vector<double> drawn;
  for (std::size_t i = 0; i < cells.values.size(); ++i) {
    if (cells.states[i] == CellState::kSolved) {
      drawn.push_back(cells.values[i]);
    }
  }
  figure.colours = colours_for(value, drawn, choice);
  Panel panel = panel_of(axes, cells);
  panel.cells = std::move(cells);
  figure.panels.push_back(std::move(panel));
  if (const Range all = range_of(drawn); drawn.size() > 1 && all.from == all.to) {
    figure.notes.push_back(
        fmt::format("All cells have one value: {}.", shown_value(value, all.from)));
  }
  if (drawn.empty()) {
    figure.notes.emplace_back("Nothing to draw: no cell has a value.");
  }
  say_no_value(figure);
  return figure;
}

Figure kind_map(const MapAxes& axes, const std::string& name, Cells cells,
                std::vector<std::string> names, const std::string& plural) {
  std::map<std::string, std::uint64_t> counts;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (cells.states[i] == CellState::kSolved) {
      ++counts[names[i]];
    }
  }
  KindCells map{.name = name};
  map.kinds = gathered(counts, plural);
  std::map<std::string, std::size_t> numbers;
  for (std::size_t k = 0; k < map.kinds.size(); ++k) {
    numbers.emplace(map.kinds[k].name, k);
    for (const auto& each : map.kinds[k].gathered) {
      numbers.emplace(each, k);
    }
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (cells.states[i] == CellState::kSolved) {
      cells.values[i] = static_cast<double>(numbers.at(names[i]));
    }
  }
  Figure figure;
  figure.gaps = gaps_of(cells);
  Panel panel = panel_of(axes, cells);
  map.cells = std::move(cells);
  map.names = std::move(names);
  if (map.kinds.empty()) {
    figure.notes.emplace_back("Nothing to draw: no cell has a value.");
  } else if (map.kinds.back().is_rest) {
    figure.notes.push_back(
        fmt::format("Of {} {} those with the most cells are named; the others are in --format csv.",
                    counts.size(), plural));
  }
  panel.kinds = std::move(map);
  figure.panels.push_back(std::move(panel));
  say_no_value(figure);
  return figure;
}

}  // namespace oblique::client::plot
