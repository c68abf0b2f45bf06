#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/explore/answer.h"
#include "client/explore/growing_study.h"
#include "client/explore/map.h"
#include "client/explore/outputs.h"
#include "client/plot/figure.h"
#include "client/study/point_flags.h"
#include "client/trace/solve_again.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/text.h"
#include "server/query/columns.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::InputError;

constexpr const char* kMapExamples = R"(Examples:
  oblique map --x mu=0.05:2 --y H=0.3:1.05 --e 1 --preset paper --out modes.svg
  oblique map --x mu=0.05:2 --y H=0.3:1.05 --e 0.8 --of stick_total_s=0 --format json > sticking.json
  oblique map friction --x mu=0.01:2 --y e=0.5:1 --of fn_peak_N=5000
  oblique map --x mu=0.05:2 --y H=0.3:1.05 --e 1 --over fn_peak_N --out peaks.svg

Finds the borders between regions of the plane of two keys, for example between modes. The points
form a study that grows round by round: it is stored, and the same command continues it. A STUDY
gives the model and the keys that have one value in it; other flags override these keys.)";

struct MapFlags {
  std::string study;
  PointFlags points;
  std::string x;
  std::string y;
  std::string of{"major_mode"};
  std::string over;
  double bracket = 1e-6;
  std::uint32_t cells = 64;
  AnswerFlags answer;
  ExploreFlags explore;
};

/// An axis of a map, with a value for each step of the lattice.
struct MapAxis {
  std::string key;
  double from;
  double to;
  std::uint32_t last;  ///< place of `to`

  /// Both ends are exact. Other values are multiples of 2^-50 times the largest power of two on the
  /// axis. Therefore the ends of a bracket are exactly its middle minus and plus half its width.
  double value(std::uint32_t place) const {
    constexpr int kBits = 50;  // fewer than the 53 bits of a double
    const double grain =
        std::ldexp(1.0, std::ilogb(std::max(std::abs(from), std::abs(to))) - kBits);
    const double value = from + (to - from) * place / last;
    return place == 0      ? from
           : place == last ? to
                           : std::clamp(std::round(value / grain) * grain, from, to);
  }
};

/// Parses --x or --y, KEY=FROM:TO. Throws InputError, naming the flag.
MapAxis parse_axis(const char* flag, const std::string& text, const MapGrid& grid) {
  const auto parts = protocol::split(text, '=');
  const auto ends = protocol::split(parts.back(), ':');
  const auto from = solver::number_of(ends.front());
  const auto to = solver::number_of(ends.back());
  if (parts.size() != 2 || ends.size() != 2 || !from || !to) {
    throw InputError(
        fmt::format("{} must be KEY=FROM:TO, for example mu=0.05:2; got \"{}\"", flag, text));
  }
  const auto& key = protocol::axis_key(parts.front());
  protocol::check_ends(key, *from, *to);
  MapAxis axis{std::string(key.name), *from + 0.0, *to + 0.0, grid.last()};  // never -0
  // Doubles must have a value for each step of the lattice.
  if (!(*to - *from > grid.last() * std::ldexp(std::max(std::abs(*from), std::abs(*to)), -50))) {
    throw InputError(fmt::format("{} {}: the ends must differ by more", flag, text));
  }
  solver::check_value(key, axis.value(1));  // refuses keys whose values are integers
  return axis;
}

/// Returns the place of the = before the level in --of, if it is the only comparison outside
/// brackets.
std::size_t level_place(std::string_view of) {
  int depth = 0;
  std::size_t place = std::string_view::npos;
  for (std::size_t i = 0; i < of.size(); ++i) {
    depth += of[i] == '(' ? 1 : of[i] == ')' ? -1 : 0;
    if (depth == 0 && std::string_view("<>=!").find(of[i]) != std::string_view::npos) {
      if (of[i] != '=' || place != std::string_view::npos) {
        return std::string_view::npos;
      }
      place = i;
    }
  }
  return place;
}

/// Returns SQL over the view `runs` for the region of a point, as --of defines it: the value of a
/// text column, or the side of the level on which a number lies. Throws InputError.
std::string sql_of_region(const std::string& of) {
  const auto equals = level_place(of);
  const auto outputs = outputs_of_flag(of.substr(0, equals), true);
  const auto level = equals == std::string::npos
                         ? std::nullopt
                         : solver::number_of(std::string_view(of).substr(
                               std::min(of.find_first_not_of(' ', equals + 1), of.size())));
  const auto& output = outputs.front();
  const bool is_text = server::kind_of_values(output) == protocol::CellKind::kText;
  if (outputs.size() != 1 || level.has_value() == is_text ||
      (equals != std::string::npos) == is_text || !std::isfinite(level.value_or(0.0))) {
    throw InputError(
        fmt::format("--of {}: write mode, major_mode, or COLUMN=LEVEL, as stick_total_s=0", of));
  }
  if (is_text) {
    return output;
  }
  const auto side = [&](const char* comparison) {
    const auto number = solver::exact_number(*level);
    return fmt::format("WHEN ({}) {} {} THEN {}", output, comparison, number,
                       server::sql_text(fmt::format("{} {} {}", output, comparison, number)));
  };
  return fmt::format("CASE WHEN typeof({}) <> 'text' THEN CASE {} {} END END", output, side(">"),
                     side("<="));
}

/// Returns SQL for the region of a point and, if given, the output of --over. Throws InputError.
std::string columns_of(const MapFlags& flags) {
  std::string columns = sql_of_region(flags.of);
  if (!flags.over.empty()) {
    const auto over = outputs_of_flag(flags.over, false, "--over");
    if (over.size() != 1) {
      throw InputError(fmt::format("--over {}: a picture shows one output", flags.over));
    }
    columns += ", " + over.front();
  }
  return columns;
}

// ---- The points of a map ----

/// The part of a map that all its points share.
struct MapPlane {
  MapGrid grid;
  std::array<MapAxis, 2> axes;  ///< x and y
  solver::ModelParameters model = {};
  std::vector<protocol::Axis> constants = {};  ///< axes of one value each, or expressions
  std::string columns = {};                    ///< SQL for the region and the output of --over

  /// The settings that decide which points are solved.
  std::string settings(const MapFlags& flags) const {
    std::string text = protocol::canonical_model(model);
    for (const auto& axis : constants) {
      text += '\n' + axis.SerializeAsString();
    }
    for (const auto& axis : axes) {
      text += fmt::format("\n{} {} {}", axis.key, axis.from, axis.to);
    }
    return text + fmt::format("\n{} {} {}", flags.of, flags.cells, flags.bracket);
  }
  protocol::Block block_of(const std::vector<LatticePoint>& points, int elements_per_link) const {
    std::vector<double> x;
    std::vector<double> y;
    for (const LatticePoint& point : points) {
      x.push_back(axes[0].value(point.x));
      y.push_back(axes[1].value(point.y));
    }
    if (elements_per_link == model.elements_per_link) {
      return listed_points({axes[0].key, axes[1].key}, {x, y}, constants);
    }
    return listed_points({axes[0].key, axes[1].key, "elements_per_link"},
                         {x, y, {static_cast<double>(elements_per_link)}}, constants);
  }
};

/// Adds the model and the keys with one value of a stored study, except for keys that are given.
void take_from_study(PointFlags& flags, const protocol::Recipe& stored, const std::string& study) {
  if (flags.preset != PointFlags().preset || !flags.lengths.empty()) {
    throw InputError("--preset and --lengths are those of the study: leave them out");
  }
  const auto text_of = [](std::string_view key, double value) {
    return key == "integrator"
               ? std::string(solver::integrator_name(static_cast<solver::Integrator>(value)))
               : solver::exact_number(value);
  };
  const auto given = flags.axes;
  for (const auto& block : stored.blocks()) {
    for (const auto& axis : block.axes()) {
      const bool is_one = protocol::has_own_values(axis) && protocol::axis_size(axis) == 1;
      const std::string text =
          is_one ? text_of(axis.key(), protocol::axis_value(axis, 0)) : axis.expression();
      if (!given.contains(axis.key()) &&
          (text.empty() || flags.axes.try_emplace(axis.key(), text).first->second != text)) {
        throw InputError(fmt::format("the study \"{}\" has several values of {}: give one with {}",
                                     study, axis.key(), flag_of_key(axis.key())));
      }
    }
  }
  const auto model = protocol::from_message(stored.model());
  for (const auto& key : solver::model_keys()) {
    if (key.name != "links" && key.name != "length") {
      flags.axes.try_emplace(std::string(key.name), text_of(key.name, key.get(model)));
    }
  }
  flags.lengths = fmt::format("{}", fmt::join(model.lengths_m, ","));
}

/// Throws InputError for values that are not allowed, including the ends of the axes.
MapPlane plane_of(Console& console, const MapFlags& flags) {
  // An unknown study is reported before other flags, as in all commands.
  const auto stored = flags.study.empty()
                          ? std::optional<protocol::Recipe>()
                          : stored_recipe(console, flags.explore.source, flags.study);
  const auto grid = MapGrid::of(flags.cells, flags.bracket);
  MapPlane plane{grid, {parse_axis("--x", flags.x, grid), parse_axis("--y", flags.y, grid)}};
  plane.columns = columns_of(flags);
  if (plane.axes[0].key == plane.axes[1].key) {
    throw InputError(fmt::format("--x and --y are both {}: name two keys", plane.axes[0].key));
  }
  auto points = flags.points;
  for (const auto& axis : plane.axes) {
    const auto ends =
        fmt::format("{},{}", solver::exact_number(axis.from), solver::exact_number(axis.to));
    if (!points.axes.try_emplace(axis.key, ends).second) {
      throw InputError(
          fmt::format("{} is an axis of the map: leave {} out", axis.key, flag_of_key(axis.key)));
    }
  }
  if (stored) {
    take_from_study(points, *stored, flags.study);
  }
  const auto recipe = recipe_of_flags(points, tip_reach(console));
  check_points(protocol::PointTable(recipe), places_of(points));
  plane.model = protocol::from_message(recipe.model());
  const int elements = plane.model.elements_per_link;
  if (!protocol::axis_key("elements_per_link").is_allowed(2 * elements)) {
    throw InputError(fmt::format(
        "--elements-per-link {} is too many: a map also solves points on twice as many", elements));
  }
  for (const auto& axis : recipe.blocks(0).axes()) {
    if (axis.key() == plane.axes[0].key || axis.key() == plane.axes[1].key) {
      continue;
    }
    if (protocol::axis_size(axis) != 1 || axis.has_distribution() ||
        axis.key() == "elements_per_link") {
      throw InputError(
          fmt::format("{} has several values, and a map needs one", flag_of_key(axis.key())));
    }
    plane.constants.push_back(axis);
  }
  return plane;
}

struct MapRegion {
  std::string name;
  int first_number;    ///< number in the order in which regions were found
  double cells = 0.0;  ///< area in cells of the coarse grid, measured on the raster
};

/// The result of `oblique map`.
struct FoundMap {
  const MapFlags& flags;
  const MapPlane& plane;
  const GrowingStudy& study;
  std::vector<MapRegion> regions = {};  ///< element i describes region i; region 0 is the largest
  Borders borders = {};
  std::vector<CurveShift> shifts = {};  ///< of each curve
  /// The values of --over at the points of the coarse grid, row by row from the lowest; NaN: none.
  std::vector<double> over = {};
  std::vector<std::string> notes = {};

  const std::string& name_of(int region) const {
    return regions[static_cast<std::size_t>(region)].name;
  }
};

/// Measures the regions, and numbers them by area, the largest first.
void sort_regions(FoundMap& map) {
  const double cells_of_pixel =
      std::pow(static_cast<double>(map.plane.grid.cells) / Borders::kRaster, 2);
  for (const int region : map.borders.raster) {
    map.regions[static_cast<std::size_t>(region)].cells += cells_of_pixel;
  }
  std::stable_sort(map.regions.begin(), map.regions.end(),
                   [](const auto& a, const auto& b) { return a.cells > b.cells; });
  std::vector<int> numbers(map.regions.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    numbers[static_cast<std::size_t>(map.regions[i].first_number)] = static_cast<int>(i);
  }
  const auto renumber = [&](int& region) { region = numbers[static_cast<std::size_t>(region)]; };
  std::for_each(map.borders.raster.begin(), map.borders.raster.end(), renumber);
  for (auto& vertex : map.borders.vertices) {
    renumber(vertex.from);
    renumber(vertex.to);
  }
}

FoundMap find_map(const MapFlags& flags, const MapPlane& plane, GrowingStudy& study) {
  FoundMap map{flags, plane, study};
  std::map<std::string, int> numbers;
  const auto solve = [&](const std::vector<LatticePoint>& points, int elements_per_link) {
    constexpr std::uint32_t kOtherRounds = 50;  // estimate: rounds for halved cells and finer mesh
    const bool is_coarse_grid = study.rounds() == 0;
    const auto table = study.solve(plane.block_of(points, elements_per_link), plane.columns,
                                   fmt::format("round {} of about {}", study.rounds() + 1,
                                               plane.grid.halvings + kOtherRounds));
    std::vector<int> regions;
    for (const auto& row : table.rows) {
      const auto* name = std::get_if<std::string>(&row.front());
      const auto [region, is_new] =
          numbers.try_emplace(name ? *name : "failed", static_cast<int>(numbers.size()));
      if (is_new) {
        map.regions.push_back({region->first, region->second});
      }
      regions.push_back(region->second);
      if (is_coarse_grid && row.size() > 1) {
        map.over.push_back(number_in(row.back()));
      }
    }
    if (is_coarse_grid && std::ranges::all_of(table.rows, [](const auto& row) {
          return !std::holds_alternative<std::string>(row.front());
        })) {
      throw std::runtime_error(fmt::format("no point of the grid has a value of {}.{}", flags.of,
                                           first_failure(study.source(), study.name())));
    }
    return regions;
  };
  const int elements = plane.model.elements_per_link;
  map.borders =
      find_borders(plane.grid, [&](const auto& points) { return solve(points, elements); });
  constexpr std::size_t kEvery = 16;
  map.shifts = find_shifts(plane.grid, map.borders, kEvery,
                           [&](const auto& points) { return solve(points, 2 * elements); });
  sort_regions(map);
  if (map.regions.size() == 1) {
    map.notes.push_back(fmt::format("No border was found: all points are in the region {}.",
                                    map.regions.front().name));
  }
  if (!map.over.empty() && std::ranges::none_of(map.over, [](double at) { return at == at; })) {
    map.notes.push_back(fmt::format("No point of the grid has a number of {}.", flags.over));
  }
  return map;
}

// ---- Tables ----

/// A vertex in units of the axes.
struct VertexValues {
  double x;
  double y;
  double width;
};

VertexValues values_of(const FoundMap& map, const BorderVertex& vertex) {
  const auto& axes = map.plane.axes;
  const MapAxis& along = axes[vertex.is_along_x ? 0 : 1];
  const double low = along.value(vertex.place());
  const double width = along.value(vertex.place() + 1) - low;
  const double middle = low + width / 2.0;
  return {vertex.is_along_x ? middle : axes[0].value(vertex.low.x),
          vertex.is_along_x ? axes[1].value(vertex.low.y) : middle, width};
}

std::string islands_sentence(const FoundMap& map) {
  const auto size = [&](const MapAxis& axis) {
    return fmt::format("{} in {}",
                       solver::readable_number((axis.to - axis.from) / map.plane.grid.cells, 3),
                       axis.key);
  };
  return fmt::format(
      "An island or sliver of another region that is smaller than a cell, {} by {}, may be missed.",
      size(map.plane.axes[0]), size(map.plane.axes[1]));
}

std::string shifts_sentence(const FoundMap& map) {
  CurveShift all{.largest = 0.0};
  for (const auto& shift : map.shifts) {
    all.checked += shift.checked;
    all.lost += shift.lost;
    all.largest = std::fmax(all.largest, shift.largest);
  }
  return fmt::format(
      "{} of {} checked vertices have no such border within 1/8 of the axis on twice as many "
      "elements; the others shift by at most {} %.",
      all.lost, all.checked, solver::readable_number(100.0 * all.largest, 2));
}

/// Returns the number of regions that tables and the picture show with letters A, B, ... All
/// smaller regions are shown as one.
std::size_t shown_regions(const FoundMap& map) {
  constexpr std::size_t kMaxShown = 16;
  const double least = std::pow(map.plane.grid.cells, 2) / 400.0;
  std::size_t shown = std::min(map.regions.size(), kMaxShown);
  while (shown > 0 && map.regions[shown - 1].cells < least) {
    --shown;
  }
  return shown;
}

std::string other_regions(const FoundMap& map) {
  return counted(map.regions.size() - shown_regions(map), "other region", "other regions");
}

char letter_of(std::size_t region) {
  return static_cast<char>('A' + region);
}

protocol::Table table_of_regions(const FoundMap& map) {
  const double whole = std::pow(map.plane.grid.cells, 2);
  const auto share = [&](double cells) { return solver::fixed_number(100.0 * cells / whole, 2); };
  protocol::Table table{{"region", map.flags.of, "share [%]"}};
  double rest = whole;
  for (std::size_t i = 0; i < shown_regions(map); ++i) {
    table.rows.push_back(
        {std::string{letter_of(i)}, map.regions[i].name, share(map.regions[i].cells)});
    rest -= map.regions[i].cells;
  }
  if (table.rows.size() < map.regions.size()) {
    table.rows.push_back({"", other_regions(map), share(rest)});
  }
  return table;
}

/// The vertices between each pair of shown regions, and the ranges of their values.
protocol::Table table_of_borders(const FoundMap& map) {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<VertexValues>> borders;
  std::int64_t others = 0;
  for (const auto& vertex : map.borders.vertices) {
    const std::pair<std::size_t, std::size_t> sides = std::minmax(vertex.from, vertex.to);
    if (sides.second < shown_regions(map)) {
      borders[sides].push_back(values_of(map, vertex));
    } else {
      ++others;
    }
  }
  protocol::Table table{{"border", "vertices", map.plane.axes[0].key, map.plane.axes[1].key}};
  const auto range = [](const std::vector<VertexValues>& vertices, double VertexValues::*axis) {
    const auto [from, to] = std::ranges::minmax(vertices, {}, axis);
    return fmt::format("{} to {}", solver::readable_number(from.*axis, 5),
                       solver::readable_number(to.*axis, 5));
  };
  for (const auto& [sides, vertices] : borders) {
    table.rows.push_back({fmt::format("{} | {}", letter_of(sides.first), letter_of(sides.second)),
                          static_cast<std::int64_t>(vertices.size()),
                          range(vertices, &VertexValues::x), range(vertices, &VertexValues::y)});
  }
  if (others > 0) {
    table.rows.push_back({"others", others, "", ""});
  }
  return table;
}

std::string tables_of(const FoundMap& map) {
  const auto borders = map.borders.vertices.empty() ? "" : text_of(table_of_borders(map)) + '\n';
  return fmt::format(
      "{}\n{}{} vertices, each in a bracket of at most {} of an axis; {} points in {} rounds\n"
      "{}\n{}\n{}{}",
      text_of(table_of_regions(map)), borders, format_count(map.borders.vertices.size()),
      solver::exact_number(map.flags.bracket), format_count(map.study.points()), map.study.rounds(),
      shifts_sentence(map), islands_sentence(map), fmt::join(map.notes, "\n"),
      map.notes.empty() ? "" : "\n");
}

// ---- Numbers ----

protocol::Table rows_of(const FoundMap& map) {
  protocol::Table table{{"x", "y", "from", "to", "width", "along"}};
  for (const auto& vertex : map.borders.vertices) {
    const auto at = values_of(map, vertex);
    table.rows.push_back({at.x, at.y, map.name_of(vertex.from), map.name_of(vertex.to), at.width,
                          vertex.is_along_x ? "x" : "y"});
  }
  return table;
}

std::string json_of(const FoundMap& map) {
  using Json = nlohmann::ordered_json;
  Json regions = Json::array();
  for (const auto& region : map.regions) {
    regions.push_back({{"name", region.name}, {"cells", region.cells}});
  }
  Json shifts = Json::array();
  for (const auto& shift : map.shifts) {  // NaN becomes null
    shifts.push_back({{"checked", shift.checked},
                      {"lost", shift.lost},
                      {"median", shift.median},
                      {"largest", shift.largest}});
  }
  return Json{{"x", map.plane.axes[0].key},
              {"y", map.plane.axes[1].key},
              {"of", map.flags.of},
              {"bracket", map.flags.bracket},
              {"vertices", json_rows(rows_of(map))},
              {"curves", map.borders.curves},
              {"shifts", std::move(shifts)},
              {"regions", std::move(regions)},
              {"notes", map.notes},
              {"study", map.study.name()},
              {"points", map.study.points()},
              {"rounds", map.study.rounds()}}
      .dump(1);
}

// ---- The picture ----

/// The raster in the colours of the regions.
plot::Cells cells_of_regions(const FoundMap& map, const plot::Panel& panel) {
  plot::Cells cells{.name = map.flags.of,
                    .x = plot::cells_between(panel.x, Borders::kRaster),
                    .y = plot::cells_between(panel.y, Borders::kRaster)};
  const std::size_t shown = shown_regions(map);
  for (std::size_t i = 0; i < shown; ++i) {
    cells.categories.push_back({.name = map.regions[i].name});
  }
  if (shown < map.regions.size()) {
    cells.categories.push_back({.name = other_regions(map), .is_other = true});
  }
  for (const int region : map.borders.raster) {
    const auto category = std::min(static_cast<std::size_t>(region), shown);
    ++cells.categories[category].points;
    cells.values.push_back(static_cast<double>(category));
    cells.states.push_back(plot::CellState::kSolved);
    cells.names.push_back(map.name_of(region));
  }
  return cells;
}

/// The cells of --over, one per point of the coarse grid.
plot::Cells cells_of_numbers(const FoundMap& map) {
  const auto around_points = [&](const MapAxis& axis) {
    std::vector<double> values;
    for (std::uint32_t i = 0; i <= map.plane.grid.cells; ++i) {
      values.push_back(axis.value(i * map.plane.grid.cell()));
    }
    return plot::cells_around(values, false);
  };
  plot::Cells cells{.name = map.flags.over,
                    .x = around_points(map.plane.axes[0]),
                    .y = around_points(map.plane.axes[1]),
                    .values = map.over};
  for (const double value : map.over) {
    cells.states.push_back(std::isfinite(value) ? plot::CellState::kSolved
                                                : plot::CellState::kFailed);
  }
  return cells;
}

plot::Figure figure_of(const FoundMap& map) {
  plot::Figure figure{.title = fmt::format("Regions of {}", map.flags.of),
                      .notes = {shifts_sentence(map), islands_sentence(map)}};
  for (const auto& axis : map.plane.constants) {
    figure.subtitle += fmt::format(
        "{} = {}, ", axis.key(),
        axis.values_size() == 1 ? solver::readable_number(axis.values(0)) : axis.expression());
  }
  figure.subtitle +=
      fmt::format("{} elements per link, {}: {} points", map.plane.model.elements_per_link,
                  map.study.name(), format_count(map.study.points()));
  const auto axis_of = [](const MapAxis& axis) {
    auto shown = plot::axis_of(axis.key, server::unit_of_column(server::column_of_key(axis.key)));
    shown.range = {axis.from, axis.to};
    return shown;
  };
  plot::Panel panel{.x = axis_of(map.plane.axes[0]), .y = axis_of(map.plane.axes[1])};
  if (map.over.empty()) {
    panel.cells = cells_of_regions(map, panel);
  } else {
    panel.cells = cells_of_numbers(map);
    figure.title = fmt::format("{} and borders of {}", map.flags.over, map.flags.of);
    figure.colours = plot::axis_of(map.flags.over, server::unit_of_column(map.flags.over));
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
  return figure;
}

// ---- The command ----

void check_map_flags(const MapFlags& flags) {
  constexpr std::uint32_t kMaxCells = 512;  // more points do not fit into the definition of a study
  constexpr double kLeastBracket = 1e-8;
  if (flags.cells < 2 || flags.cells > kMaxCells) {
    throw InputError(
        fmt::format("--cells {} is not allowed: it must be from 2 to {}", flags.cells, kMaxCells));
  }
  if (!(flags.bracket >= kLeastBracket && flags.bracket <= 1.0 / flags.cells)) {
    throw InputError(fmt::format(
        "--bracket {} is not allowed: it must be from {} to 1/{}, a cell's part of an axis",
        flags.bracket, kLeastBracket, flags.cells));
  }
  // Each row of cells has up to 16 borders. A border takes about 16 points inside its cell and 6
  // brackets that are halved. A point takes 16 bytes.
  const double cells = flags.cells;
  const double halvings = MapGrid::of(flags.cells, flags.bracket).halvings;
  const double points = std::pow(cells + 1.0, 2) + 16.0 * cells * (16.0 + 6.0 * halvings);
  if (16.0 * points > static_cast<double>(protocol::kMaxRecipeBytes)) {
    throw InputError(
        fmt::format("--cells {} --bracket {}: a map may need {:.0f} MiB, and a study "
                    "can have 16 MiB: give fewer cells or a wider bracket",
                    flags.cells, flags.bracket, 16.0 * points / 0x1p20));
  }
  check(flags.answer);
}

int run_map(const MapFlags& flags, Console& console) {
  check_map_flags(flags);
  return run_exploration(console, [&](protocol::StopSignals& stop) {
    const MapPlane plane = plane_of(console, flags);
    GrowingStudy study(console, flags.explore,
                       explored_name(flags.explore, "map", plane.settings(flags)), plane.model,
                       stop);
    const auto map = find_map(flags, plane, study);
    put_out(console, flags.answer,
            {.tables = tables_of(map),
             .rows = rows_of(map),
             .json = json_of(map),
             .figure = figure_of(map),
             .notes = map.notes});
    console.note(fmt::format("The points are the study {}.", study.name()));
    return kDone;
  });
}

}  // namespace

void add_map(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "map", "Find where the motion changes, on a plane of two keys",
                  kMapExamples, run_map);
  command
      .add_option("STUDY", flags.study,
                  "study whose model and single values the map takes; or give them by flags")
      ->type_name("");
  command.add_option("--x", flags.x, "horizontal axis")->type_name("KEY=FROM:TO");
  command.add_option("--y", flags.y, "vertical axis")->type_name("KEY=FROM:TO");
  command
      .add_option(
          "--of", flags.of,
          "what tells regions apart: mode, major_mode (ripples merged), or a level of an output")
      ->type_name("mode|major_mode|COLUMN=LEVEL")
      ->capture_default_str();
  command
      .add_option("--bracket", flags.bracket,
                  "largest interval in which a border is bracketed, as a part of the axis")
      ->type_name("PART")
      ->capture_default_str();
  command.add_option("--cells", flags.cells, "cells of the coarse grid along each axis")
      ->type_name("N")
      ->capture_default_str();
  command.add_option("--over", flags.over, "colour the picture by this output")
      ->type_name("COLUMN");
  add_answer_flags(command, flags.answer);
  add_explore_flags(command, flags.explore);
  add_point_flags(command, flags.points, FlagValues::kOne);
}

}  // namespace oblique::client
