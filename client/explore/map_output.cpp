#include "client/explore/map_output.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/io/console.h"
#include "client/io/row_output.h"
#include "proto/recipe/model_message.h"
#include "proto/wire/chunk.h"
#include "server/query/columns.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

/// A vertex in units of the axes.
struct ShownVertex {
  double x;
  double y;
  double width;
};

ShownVertex shown_vertex(const FoundMap& map, const BorderVertex& vertex) {
  const auto& along = map.axes[vertex.is_along_x ? 0 : 1];
  const std::uint32_t place = vertex.is_along_x ? vertex.low.x : vertex.low.y;
  const double low = along.value(place);
  const double high = along.value(place + 1);
  const double middle = low + (high - low) / 2.0;
  return {vertex.is_along_x ? middle : map.axes[0].value(vertex.low.x),
          vertex.is_along_x ? map.axes[1].value(vertex.low.y) : middle, high - low};
}

/// The value between two places of the lattice.
double value_between(const MapAxis& axis, const MapGrid& grid, double place) {
  const auto low = std::min(static_cast<std::uint32_t>(place), grid.last() - 1);
  const double share = place - low;
  return (1.0 - share) * axis.value(low) + share * axis.value(low + 1);
}

/// The curve of each vertex.
std::vector<std::size_t> curve_of_vertex(const Borders& borders) {
  std::vector<std::size_t> curves(borders.vertices.size());
  for (std::size_t curve = 0; curve < borders.curves.size(); ++curve) {
    for (const auto vertex : borders.curves[curve].vertices) {
      curves[vertex] = curve;
    }
  }
  return curves;
}

std::string letter_of_region(const FoundMap& map, int region) {
  const auto& name = map.names[static_cast<std::size_t>(region)];
  const auto place = std::find_if(map.regions.begin(), map.regions.end(),
                                  [&](const MapRegion& each) { return each.name == name; });
  return place == map.regions.end()
             ? name
             : region_letter(static_cast<std::size_t>(place - map.regions.begin()));
}

/// "0.31 to 0.52": the values that a curve has along an axis.
std::string range_of_curve(const FoundMap& map, const BorderCurve& curve, bool is_x) {
  double least = std::numeric_limits<double>::infinity();
  double largest = -least;
  for (const auto number : curve.vertices) {
    const auto vertex = shown_vertex(map, map.borders.vertices[number]);
    least = std::min(least, is_x ? vertex.x : vertex.y);
    largest = std::max(largest, is_x ? vertex.x : vertex.y);
  }
  return fmt::format("{} to {}", solver::readable_number(least, 5),
                     solver::readable_number(largest, 5));
}

/// A part as a percentage with two digits.
std::string percent_of_axis(double part) {
  return solver::readable_number(100.0 * part, 2);
}

protocol::Table table_of_regions(const FoundMap& map) {
  const double all = static_cast<double>(map.grid.cells) * map.grid.cells;
  protocol::Table table{{"region", map.of, "share [%]"}};
  for (std::size_t i = 0; i < map.regions.size(); ++i) {
    table.rows.push_back({region_letter(i), map.regions[i].name,
                          solver::fixed_number(100.0 * map.regions[i].cells / all, 2)});
  }
  return table;
}

protocol::Table table_of_curves(const FoundMap& map) {
  protocol::Table table{{"curve", "between", "vertices", map.axes[0].key(), map.axes[1].key()}};
  if (!map.shifts.empty()) {
    table.columns.insert(table.columns.end(), {"median shift [%]", "largest shift [%]", "lost"});
  }
  for (std::size_t i = 0; i < map.borders.curves.size(); ++i) {
    const auto& curve = map.borders.curves[i];
    const auto& vertex = map.borders.vertices[curve.vertices.front()];
    const auto sides =
        std::minmax({letter_of_region(map, vertex.from), letter_of_region(map, vertex.to)});
    auto& row = table.rows.emplace_back(protocol::Row{
        static_cast<std::int64_t>(i), fmt::format("{} | {}", sides.first, sides.second),
        static_cast<std::int64_t>(curve.vertices.size() - (curve.is_closed() ? 1 : 0)),
        range_of_curve(map, curve, true), range_of_curve(map, curve, false)});
    if (!map.shifts.empty()) {
      const auto& shift = map.shifts[i];
      const bool is_found = shift.checked > shift.lost;
      row.emplace_back(is_found ? percent_of_axis(shift.median) : "-");
      row.emplace_back(is_found ? percent_of_axis(shift.largest) : "-");
      row.emplace_back(fmt::format("{} of {}", shift.lost, shift.checked));
    }
  }
  // Long curves first.
  std::stable_sort(table.rows.begin(), table.rows.end(), [](const auto& one, const auto& other) {
    return std::get<std::int64_t>(one[2]) > std::get<std::int64_t>(other[2]);
  });
  return table;
}

}  // namespace

MapAxis::MapAxis(const solver::ParameterKey& key, double from, double to, bool is_logarithmic,
                 const MapGrid& grid)
    : key_(key.name),
      is_logarithmic_(is_logarithmic),
      cell_(grid.cell()),
      values_(protocol::counted_axis(
          key, from, to, std::int64_t{grid.last()} + 1,
          is_logarithmic ? protocol::SPACING_LOGARITHMIC : protocol::SPACING_LINEAR)) {
  constexpr int kBits = 44;  // far finer than any bracket, and 9 less than a double has
  grain_ = std::ldexp(1.0, std::ilogb(std::max(std::abs(from), std::abs(to))) - kBits);
}

double MapAxis::value(std::uint32_t place) const {
  const double value = values_.at(place);
  return place % cell_ == 0 ? value : std::round(value / grain_) * grain_;
}

std::string region_letter(std::size_t place) {
  constexpr std::size_t kLetters = 26;
  std::string letter(1, static_cast<char>('A' + place % kLetters));
  return place < kLetters ? letter : letter + std::to_string(place / kLetters + 1);
}

std::string missed_sentence(const FoundMap& map) {
  const auto size = [&](const MapAxis& axis) {
    const double ends[2]{axis.value(0), axis.value(map.grid.last())};
    if (axis.is_logarithmic()) {
      return fmt::format(
          "a factor of {} in {}",
          solver::readable_number(std::pow(ends[1] / ends[0], 1.0 / map.grid.cells), 5),
          axis.key());
    }
    return fmt::format("{} in {}", solver::readable_number((ends[1] - ends[0]) / map.grid.cells, 3),
                       axis.key());
  };
  return fmt::format(
      "An island or sliver of another region that is smaller than a cell, {} by {}, may be missed.",
      size(map.axes[0]), size(map.axes[1]));
}

std::string map_table(const FoundMap& map) {
  std::ostringstream out;
  print(out, table_of_regions(map), Format::kTable);
  out << '\n';
  constexpr std::size_t kMostCurves = 40;
  auto curves = table_of_curves(map);
  const std::size_t all = curves.rows.size();
  curves.rows.resize(std::min(all, kMostCurves));
  if (all > 0) {
    print(out, curves, Format::kTable);
    out << '\n';
  }
  if (all > kMostCurves) {
    out << fmt::format("The {} longest of {} curves; csv and json have all.\n", kMostCurves, all);
  }
  out << fmt::format(
      "{} vertices, each in a bracket of at most {} of an axis; {} points in {} rounds\n",
      format_count(map.borders.vertices.size()), solver::exact_number(map.bracket),
      format_count(map.points), map.rounds);
  if (!map.shifts.empty()) {
    out << "Shifts are those of the curve on twice as many elements a link, in percent of the "
           "axis; "
           "lost: no such border within an eighth of the axis.\n";
  }
  out << missed_sentence(map) << '\n';
  return out.str();
}

std::string map_csv(const FoundMap& map) {
  const auto curves = curve_of_vertex(map.borders);
  protocol::Table table{{"vertex", "curve", "x", "y", "from", "to", "width", "along"}};
  for (std::size_t i = 0; i < map.borders.vertices.size(); ++i) {
    const auto& vertex = map.borders.vertices[i];
    const auto at = shown_vertex(map, vertex);
    table.rows.push_back({static_cast<std::int64_t>(i), static_cast<std::int64_t>(curves[i]), at.x,
                          at.y, map.names[static_cast<std::size_t>(vertex.from)],
                          map.names[static_cast<std::size_t>(vertex.to)], at.width,
                          vertex.is_along_x ? "x" : "y"});
  }
  std::ostringstream out;
  print(out, table, Format::kCsv);
  return out.str();
}

std::string map_json(const FoundMap& map) {
  using Json = nlohmann::ordered_json;
  const auto name = [&map](int region) { return map.names[static_cast<std::size_t>(region)]; };
  Json json{
      {"x", map.axes[0].key()}, {"y", map.axes[1].key()}, {"of", map.of}, {"bracket", map.bracket}};
  json["x_range"] = {map.axes[0].value(0), map.axes[0].value(map.grid.last())};
  json["y_range"] = {map.axes[1].value(0), map.axes[1].value(map.grid.last())};
  json["vertices"] = Json::array();
  for (const auto& vertex : map.borders.vertices) {
    const auto at = shown_vertex(map, vertex);
    json["vertices"].push_back({{"x", at.x},
                                {"y", at.y},
                                {"from", name(vertex.from)},
                                {"to", name(vertex.to)},
                                {"width", at.width},
                                {"along", vertex.is_along_x ? "x" : "y"}});
  }
  json["curves"] = Json::array();
  json["shifts"] = Json::array();
  for (const auto& curve : map.borders.curves) {
    json["curves"].push_back(curve.vertices);
  }
  for (const auto& shift : map.shifts) {
    json["shifts"].push_back({{"checked", shift.checked},
                              {"lost", shift.lost},
                              {"median", shift.median},
                              {"largest", shift.largest}});
  }
  json["corners"] = Json::array();
  for (std::size_t i = 0; i < map.borders.corners.size(); ++i) {
    const auto& corner = map.borders.corners[i];
    Json regions = Json::array();
    Json curves = Json::array();
    for (const int region : corner.regions) {
      regions.push_back(name(region));
    }
    for (std::size_t curve = 0; curve < map.borders.curves.size(); ++curve) {
      if (map.borders.curves[curve].begins_at == i || map.borders.curves[curve].ends_at == i) {
        curves.push_back(curve);
      }
    }
    json["corners"].push_back({{"x", value_between(map.axes[0], map.grid, corner.middle.x)},
                               {"y", value_between(map.axes[1], map.grid, corner.middle.y)},
                               {"size", static_cast<double>(corner.size) / map.grid.last()},
                               {"regions", regions},
                               {"curves", curves}});
  }
  json["regions"] = Json::array();
  for (const auto& region : map.regions) {
    json["regions"].push_back({{"name", region.name}, {"cells", region.cells}});
  }
  json["cells"] = map.grid.cells;
  json["study"] = map.study;
  json["points"] = map.points;
  json["rounds"] = map.rounds;
  return json.dump(2) + '\n';
}

// ---- The picture ----

namespace {

plot::FigureAxis figure_axis(const MapAxis& axis, const MapGrid& grid) {
  auto shown = plot::axis_of(axis.key(), server::unit_of_column(server::column_of_key(axis.key())));
  shown.is_logarithmic = axis.is_logarithmic();
  shown.range = {axis.value(0), axis.value(grid.last())};
  return shown;
}

/// The cells of the raster coloured by region. The largest regions have their own colours; the
/// others share one.
plot::Cells cells_of_regions(const FoundMap& map) {
  plot::Cells cells{.name = map.of};
  for (std::size_t i = 0; i <= map.raster_cells; ++i) {
    const double place = static_cast<double>(map.grid.last()) * static_cast<double>(i) /
                         static_cast<double>(map.raster_cells);
    cells.x.edges.push_back(value_between(map.axes[0], map.grid, place));
    cells.y.edges.push_back(value_between(map.axes[1], map.grid, place));
  }
  for (auto* axis : {&cells.x, &cells.y}) {
    for (std::size_t i = 0; i < map.raster_cells; ++i) {
      axis->values.push_back((axis->edges[i] + axis->edges[i + 1]) / 2.0);
    }
  }
  constexpr std::size_t kMostCategories = 16;
  constexpr double kLeastShare = 1.0 / 400;
  const double all = static_cast<double>(map.grid.cells) * map.grid.cells;
  for (const auto& region : map.regions) {
    if (cells.categories.size() < kMostCategories && region.cells >= kLeastShare * all) {
      cells.categories.push_back({.name = region.name});
    }
  }
  const std::size_t named = cells.categories.size();
  if (named < map.regions.size()) {
    cells.categories.push_back(
        {.name = fmt::format("{} others", map.regions.size() - named), .is_other = true});
  }
  for (const int region : map.raster) {
    const auto& name = map.names[static_cast<std::size_t>(region)];
    const auto place = static_cast<std::size_t>(
        std::find_if(map.regions.begin(), map.regions.end(),
                     [&](const MapRegion& each) { return each.name == name; }) -
        map.regions.begin());
    const std::size_t category = std::min(place, cells.categories.size() - 1);
    ++cells.categories[category].points;
    cells.values.push_back(static_cast<double>(category));
    cells.states.push_back(plot::CellState::kSolved);
    cells.names.push_back(name);
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
  cells.x.edges = plot::edges_between(cells.x.values, map.axes[0].is_logarithmic());
  cells.y.edges = plot::edges_between(cells.y.values, map.axes[1].is_logarithmic());
  for (const double value : map.over) {
    cells.states.push_back(std::isfinite(value) ? plot::CellState::kSolved
                                                : plot::CellState::kFailed);
  }
  return cells;
}

}  // namespace

plot::Figure map_figure(const FoundMap& map) {
  plot::Figure figure{
      .title = fmt::format("Regions of {}", map.of),
      .subtitle = fmt::format("{}: {} points", map.study, format_count(map.points))};
  plot::Panel panel{.x = figure_axis(map.axes[0], map.grid),
                    .y = figure_axis(map.axes[1], map.grid)};
  if (map.over.empty()) {
    panel.cells = cells_of_regions(map);
  } else {
    panel.cells = cells_of_numbers(map);
    figure.title = fmt::format("{} and borders of {}", map.over_name, map.of);
    figure.colours = plot::axis_of(map.over_name, server::unit_of_column(map.over_name));
    figure.colours->span(plot::range_of(map.over));
    panel.x.range = {panel.cells->x.edges.front(), panel.cells->x.edges.back()};
    panel.y.range = {panel.cells->y.edges.front(), panel.cells->y.edges.back()};
  }
  for (const auto& curve : map.borders.curves) {
    plot::Curve line{.mark = plot::Curve::Mark::kBorder};
    const auto add_corner = [&](const std::optional<std::size_t>& corner) {
      if (corner) {
        const auto& at = map.borders.corners[*corner].middle;
        line.x.push_back(value_between(map.axes[0], map.grid, at.x));
        line.y.push_back(value_between(map.axes[1], map.grid, at.y));
      }
    };
    add_corner(curve.begins_at);
    for (const auto number : curve.vertices) {
      const auto vertex = shown_vertex(map, map.borders.vertices[number]);
      line.x.push_back(vertex.x);
      line.y.push_back(vertex.y);
    }
    add_corner(curve.ends_at);
    panel.curves.push_back(std::move(line));
  }
  figure.panels.push_back(std::move(panel));
  figure.notes.push_back(missed_sentence(map));
  return figure;
}

}  // namespace oblique::client
