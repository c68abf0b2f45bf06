#include "client/plot/figures/maps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/formats/table_printer.h"
#include "client/output/human_units.h"
#include "client/plot/draw/areas.h"

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

/// The kinds by the number of their points, largest first, those with next to none gathered in the
/// last one.
std::vector<Kind> gathered(const std::map<std::string, std::uint64_t>& points,
                           const std::string& plural) {
  std::vector<Kind> kinds;
  std::uint64_t whole = 0;
  for (const auto& [name, count] : points) {
    kinds.push_back({.name = name, .points = count});
    whole += count;
  }
  std::stable_sort(kinds.begin(), kinds.end(),
                   [](const Kind& a, const Kind& b) { return a.points > b.points; });
  std::size_t kept = kinds.size();
  if (kept > kMostKinds) {
    // A kind that has less than a quarter of a per cent is nowhere to be seen.
    kept = kMostKinds;
    while (kept > 1 && kinds[kept - 1].points * 400 < whole) {
      --kept;
    }
  }
  if (kept + 1 >= kinds.size()) {  // one alone has its own name
    return kinds;
  }
  Kind rest{.name = {}, .is_rest = true};
  for (std::size_t i = kept; i < kinds.size(); ++i) {
    rest.points += kinds[i].points;
    rest.gathered.push_back(kinds[i].name);
  }
  rest.name = fmt::format("{} other {}", shown_count(rest.gathered.size()), plural);
  kinds.resize(kept);
  kinds.push_back(std::move(rest));
  return kinds;
}

/// Gives each solved cell the number of its kind.
void number_cells(KindCells& map) {
  std::map<std::string, std::size_t> numbers;
  for (std::size_t k = 0; k < map.kinds.size(); ++k) {
    if (!map.kinds[k].is_rest) {
      numbers.emplace(map.kinds[k].name, k);
    }
  }
  for (std::size_t i = 0; i < map.names.size(); ++i) {
    if (map.cells.states[i] == CellState::kSolved) {
      const auto found = numbers.find(map.names[i]);
      map.cells.values[i] =
          static_cast<double>(found == numbers.end() ? map.kinds.size() - 1 : found->second);
    }
  }
  map.least_outlined = least_outlined(kind_grid_of(map.cells));
}

void say_kinds(Figure& figure, const KindCells& map, std::size_t kinds, const std::string& plural) {
  if (map.kinds.empty()) {
    say_empty(figure, "no cell has a value");
    return;
  }
  if (map.name == "mode" || map.name == "major_mode") {
    figure.notes.push_back(fmt::format("{}: in the order of time.", kModeLetters));
  }
  if (map.kinds.back().is_rest) {
    figure.notes.push_back(fmt::format(
        "Of {} {} those with the most points are named; the others are in --format csv.",
        shown_count(kinds), plural));
  }
  if (map.least_outlined == 0) {
    figure.notes.push_back(fmt::format(
        "Too many cells differ from those beside them to be outlined: {} are colours alone.",
        plural));
  } else if (map.least_outlined > 1) {
    figure.notes.push_back(
        fmt::format("Areas of fewer than {} cells are colours alone, without hatching and outline.",
                    map.least_outlined));
  }
}

}  // namespace

Colours colours_for(const Quantity& quantity, const std::vector<double>& values,
                    const ColourChoice& choice) {
  const Range all = range_of(values, choice.is_logarithmic);
  const Scale scale(choice.range ? choice.range->from : all.from,
                    choice.range ? choice.range->to : all.to, choice.is_logarithmic);
  Colours colours{axis_of(quantity, {scale.from(), scale.to()}, choice.is_logarithmic)};
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
  figure.colours->has_plate = std::find(cells.states.begin(), cells.states.end(),
                                        CellState::kNoPoint) != cells.states.end();
  Panel panel = panel_of(axes, cells);
  panel.cells = std::move(cells);
  figure.panels.push_back(std::move(panel));
  if (const Range all = range_of(drawn); drawn.size() > 1 && all.from == all.to) {
    figure.notes.push_back(
        fmt::format("All cells have one value: {}.", shown_value(value, all.from)));
  }
  if (drawn.empty()) {
    say_empty(figure, "no cell has a value");
  }
  say_no_value(figure);
  return figure;
}

Figure kind_map(const MapAxes& axes, const std::string& name, Cells cells,
                std::vector<std::string> names, const std::map<std::string, std::uint64_t>& points,
                const std::string& plural) {
  KindCells map{.name = name};
  map.cells = std::move(cells);
  map.names = std::move(names);
  map.kinds = gathered(points, plural);
  number_cells(map);
  Figure figure;
  figure.gaps = gaps_of(map.cells);
  Panel panel = panel_of(axes, map.cells);
  say_kinds(figure, map, points.size(), plural);
  panel.kinds = std::move(map);
  figure.panels.push_back(std::move(panel));
  say_no_value(figure);
  return figure;
}

}  // namespace oblique::client::plot
