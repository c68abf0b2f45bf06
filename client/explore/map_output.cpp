#include "client/explore/map_output.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/io/console.h"
#include "client/plot/figure.h"
#include "proto/wire/chunk.h"
#include "server/query/columns.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

/// A vertex in units of the axes.
struct VertexValues {
  double x;
  double y;
  double width;
};

VertexValues values_of(const FoundMap& map, const BorderVertex& vertex) {
  const MapAxis& along = map.axes[vertex.is_along_x ? 0 : 1];
  const std::uint32_t place = vertex.is_along_x ? vertex.low.x : vertex.low.y;
  const double low = along.value(place);
  const double width = along.value(place + 1) - low;
  const double middle = low + width / 2.0;
  return {vertex.is_along_x ? middle : map.axes[0].value(vertex.low.x),
          vertex.is_along_x ? map.axes[1].value(vertex.low.y) : middle, width};
}

const std::string& name_of_region(const FoundMap& map, int region) {
  return map.regions[static_cast<std::size_t>(region)].name;
}

/// A, B, ..., Z, A2, ...
std::string letter_of(int region) {
  constexpr int kLetters = 26;
  std::string letter(1, static_cast<char>('A' + region % kLetters));
  return region < kLetters ? letter : letter + std::to_string(region / kLetters + 1);
}

std::string islands_sentence(const FoundMap& map) {
  const auto size = [&](const MapAxis& axis) {
    return fmt::format("{} in {}",
                       solver::readable_number((axis.to() - axis.from()) / map.grid.cells, 3),
                       axis.key());
  };
  return fmt::format(
      "An island or sliver of another region that is smaller than a cell, {} by {}, may be missed.",
      size(map.axes[0]), size(map.axes[1]));
}

// ---- Tables ----

protocol::Table table_of_regions(const FoundMap& map) {
  const double all = static_cast<double>(map.grid.cells) * map.grid.cells;
  protocol::Table table{{"region", map.of, "share [%]"}};
  for (std::size_t i = 0; i < map.regions.size(); ++i) {
    table.rows.push_back({letter_of(static_cast<int>(i)), map.regions[i].name,
                          solver::fixed_number(100.0 * map.regions[i].cells / all, 2)});
  }
  return table;
}

/// The vertices between each pair of regions, and where they are.
protocol::Table table_of_borders(const FoundMap& map) {
  struct Border {
    std::int64_t vertices = 0;
    std::array<std::vector<double>, 2> values = {};
  };
  std::map<std::pair<int, int>, Border> borders;
  for (const auto& vertex : map.borders.vertices) {
    const auto at = values_of(map, vertex);
    auto& border = borders[std::minmax(vertex.from, vertex.to)];
    ++border.vertices;
    border.values[0].push_back(at.x);
    border.values[1].push_back(at.y);
  }
  protocol::Table table{{"border", "vertices", map.axes[0].key(), map.axes[1].key()}};
  const auto ends = [](const std::vector<double>& values) {
    const auto [least, largest] = std::minmax_element(values.begin(), values.end());
    return fmt::format("{} to {}", solver::readable_number(*least, 5),
                       solver::readable_number(*largest, 5));
  };
  for (const auto& [sides, border] : borders) {
    table.rows.push_back({fmt::format("{} | {}", letter_of(sides.first), letter_of(sides.second)),
                          border.vertices, ends(border.values[0]), ends(border.values[1])});
  }
  return table;
}

std::string shifts_sentence(const FoundMap& map) {
  CurveShift all;
  double largest = 0.0;
  for (const auto& shift : map.shifts) {
    all.checked += shift.checked;
    all.lost += shift.lost;
    largest = std::max(largest, shift.largest.value_or(0.0));
  }
  return fmt::format(
      "{} of {} checked vertices have no such border within 1/8 of the axis on twice as many "
      "elements; the others shift by at most {} %.\n",
      all.lost, all.checked, solver::readable_number(100.0 * largest, 2));
}

std::string tables_of(const FoundMap& map) {
  std::string text = text_of(table_of_regions(map)) + '\n';
  if (!map.borders.vertices.empty()) {
    text += text_of(table_of_borders(map)) + '\n';
  }
  return text +
         fmt::format(
             "{} vertices, each in a bracket of at most {} of an axis; {} points in {} rounds\n",
             format_count(map.borders.vertices.size()), solver::exact_number(map.bracket),
             format_count(map.points), map.rounds) +
         shifts_sentence(map) + islands_sentence(map) + '\n';
}

// ---- Numbers ----

protocol::Table rows_of(const FoundMap& map) {
  protocol::Table table{{"x", "y", "from", "to", "width", "along"}};
  for (const auto& vertex : map.borders.vertices) {
    const auto at = values_of(map, vertex);
    table.rows.push_back({at.x, at.y, name_of_region(map, vertex.from),
                          name_of_region(map, vertex.to), at.width, vertex.is_along_x ? "x" : "y"});
  }
  return table;
}

std::string json_of(const FoundMap& map) {
  using Json = nlohmann::ordered_json;
  Json vertices = Json::array();
  for (const auto& vertex : map.borders.vertices) {
    const auto at = values_of(map, vertex);
    vertices.push_back({{"x", at.x},
                        {"y", at.y},
                        {"from", name_of_region(map, vertex.from)},
                        {"to", name_of_region(map, vertex.to)},
                        {"width", at.width},
                        {"along", vertex.is_along_x ? "x" : "y"}});
  }
  Json regions = Json::array();
  for (const auto& region : map.regions) {
    regions.push_back({{"name", region.name}, {"cells", region.cells}});
  }
  Json shifts = Json::array();
  const auto number = [](const std::optional<double>& part) { return part ? Json(*part) : Json(); };
  for (const auto& shift : map.shifts) {
    shifts.push_back({{"checked", shift.checked},
                      {"lost", shift.lost},
                      {"median", number(shift.median)},
                      {"largest", number(shift.largest)}});
  }
  return Json{{"x", map.axes[0].key()},
              {"y", map.axes[1].key()},
              {"of", map.of},
              {"bracket", map.bracket},
              {"vertices", std::move(vertices)},
              {"curves", map.borders.curves},
              {"shifts", std::move(shifts)},
              {"regions", std::move(regions)},
              {"study", map.study},
              {"points", map.points},
              {"rounds", map.rounds}}
      .dump(1);
}

// ---- The picture ----

/// The raster in the colours of the regions: the largest, and all others as one.
plot::Cells cells_of_regions(const FoundMap& map) {
  constexpr std::size_t kMaxCategories = 16;
  constexpr double kLeastShare = 1.0 / 400;
  plot::Cells cells{.name = map.of};
  for (auto* axis : {&cells.x, &cells.y}) {
    const MapAxis& values = map.axes[axis == &cells.x ? 0 : 1];
    const double step = (values.to() - values.from()) / Borders::kRaster;
    for (std::uint32_t i = 0; i <= Borders::kRaster; ++i) {
      axis->edges.push_back(values.from() + step * i);
      if (i > 0) {
        axis->values.push_back(values.from() + step * (i - 0.5));
      }
    }
  }
  const double all = static_cast<double>(map.grid.cells) * map.grid.cells;
  for (const auto& region : map.regions) {
    if (cells.categories.size() < kMaxCategories && region.cells >= kLeastShare * all) {
      cells.categories.push_back({.name = region.name});
    }
  }
  const std::size_t others = map.regions.size() - cells.categories.size();
  if (others > 0) {
    cells.categories.push_back({.name = fmt::format("{} others", others), .is_other = true});
  }
  for (const int region : map.borders.raster) {
    const auto category = std::min(static_cast<std::size_t>(region), cells.categories.size() - 1);
    ++cells.categories[category].points;
    cells.values.push_back(static_cast<double>(category));
    cells.states.push_back(plot::CellState::kSolved);
    cells.names.push_back(name_of_region(map, region));
  }
  return cells;
}

/// The numbers of --over around the points of the coarse grid.
plot::Cells cells_of_numbers(const FoundMap& map) {
  plot::Cells cells{.name = map.over_name, .values = map.over};
  for (std::uint32_t i = 0; i <= map.grid.cells; ++i) {
    cells.x.values.push_back(map.axes[0].value(i * map.grid.cell()));
    cells.y.values.push_back(map.axes[1].value(i * map.grid.cell()));
  }
  cells.x.edges = plot::edges_between(cells.x.values, false);
  cells.y.edges = plot::edges_between(cells.y.values, false);
  for (const double value : map.over) {
    cells.states.push_back(std::isfinite(value) ? plot::CellState::kSolved
                                                : plot::CellState::kFailed);
  }
  return cells;
}

plot::Figure figure_of(const FoundMap& map) {
  plot::Figure figure{
      .title = fmt::format("Regions of {}", map.of),
      .subtitle = fmt::format("{}: {} points", map.study, format_count(map.points))};
  const auto axis_of = [](const MapAxis& axis) {
    auto shown =
        plot::axis_of(axis.key(), server::unit_of_column(server::column_of_key(axis.key())));
    shown.range = {axis.from(), axis.to()};
    return shown;
  };
  plot::Panel panel{.x = axis_of(map.axes[0]), .y = axis_of(map.axes[1])};
  if (map.over.empty()) {
    panel.cells = cells_of_regions(map);
  } else {
    panel.cells = cells_of_numbers(map);
    figure.title = fmt::format("{} and borders of {}", map.over_name, map.of);
    figure.colours = plot::axis_of(map.over_name, server::unit_of_column(map.over_name));
    figure.colours->span(plot::range_of(map.over));
  }
  for (const auto& curve : map.borders.curves) {
    auto& line = panel.curves.emplace_back(plot::Curve{.mark = plot::Curve::Mark::kBorder});
    for (const auto number : curve) {
      const auto vertex = values_of(map, map.borders.vertices[number]);
      line.x.push_back(vertex.x);
      line.y.push_back(vertex.y);
    }
  }
  figure.panels.push_back(std::move(panel));
  figure.notes.push_back(islands_sentence(map));
  return figure;
}

}  // namespace

MapAxis::MapAxis(std::string key, double from, double to, const MapGrid& grid)
    : key_(std::move(key)), from_(from), to_(to), last_(grid.last()) {
  constexpr int kBits = 50;  // a double has 53
  grain_ = std::ldexp(1.0, std::ilogb(std::max(std::abs(from), std::abs(to))) - kBits);
}

double MapAxis::value(std::uint32_t place) const {
  const double value = from_ + (to_ - from_) * place / last_;
  return place == 0       ? from_
         : place == last_ ? to_
                          : std::clamp(std::round(value / grain_) * grain_, from_, to_);
}

Answer answer_of(const FoundMap& map) {
  return {.tables = tables_of(map),
          .rows = rows_of(map),
          .json = json_of(map),
          .figure = figure_of(map)};
}

}  // namespace oblique::client
