#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/explore/growing_study.h"
#include "client/explore/map.h"
#include "client/explore/map_output.h"
#include "client/io/row_output.h"
#include "client/plot/picture_file.h"
#include "client/study/point_flags.h"
#include "client/trace/solve_again.h"
#include "proto/program/usage.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/text.h"
#include "server/query/columns.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::InputError;

constexpr const char* kMapExamples = R"(Examples:
  oblique map --x mu=0.05:2 --y H=0.3:1.05 --e 1 --preset paper --out modes.svg
  oblique map --x mu=0.05:2 --y H=0.3:1.05 --e 0.8 --of stick_total_s=0 --format json > sticking.json
  oblique map friction --x mu=0.01:2:log --y e=0.5:1 --of fn_peak_N=5000
  oblique map --x mu=0.05:2 --y H=0.3:1.05 --e 1 --over fn_peak_N --out peaks.svg

Finds the borders between regions (for example of equal mode) in the plane of two keys. The points form a
study that grows round by round. It is stored, and the same command continues it. If a STUDY is given, its
model and its keys with a single value are used; other flags override them. --out may be repeated.)";

struct MapFlags {
  std::string study;
  PointFlags points;
  std::string x;
  std::string y;
  std::string of{"major_mode"};
  std::string over;
  double bracket = 1e-6;
  std::uint32_t cells = 64;
  std::size_t check = 16;
  std::string format{"table"};
  std::vector<std::string> out;
  ExploreFlags explore;
};

constexpr std::array<std::string_view, 3> kFormats{"table", "csv", "json"};

// ---- What the flags say ----

/// KEY=FROM:TO, or KEY=FROM:TO:log.
struct AxisFlag {
  const solver::ParameterKey* key;
  double from;
  double to;
  bool is_logarithmic;
};

AxisFlag axis_flag(const char* flag, const std::string& text) {
  if (text.empty()) {
    throw InputError(
        fmt::format("{} is missing: give the axes of the map as --x mu=0.05:2 --y H=0.3:1", flag));
  }
  const auto equals = text.find('=');
  const auto parts = protocol::split(
      std::string_view(text).substr(equals == std::string::npos ? text.size() : equals + 1), ':');
  const bool is_logarithmic = parts.size() == 3 && parts[2] == "log";
  const bool is_range = parts.size() == (is_logarithmic ? 3 : 2);
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const double from = is_range ? solver::number_of(parts[0]).value_or(kNone) : kNone;
  const double to = is_range ? solver::number_of(parts[1]).value_or(kNone) : kNone;
  if (std::isnan(from) || std::isnan(to)) {
    throw InputError(fmt::format(
        "{} {} is no axis: write KEY=FROM:TO, as mu=0.05:2, or KEY=FROM:TO:log", flag, text));
  }
  const auto& key = protocol::axis_key(std::string_view(text).substr(0, equals));
  if (key.name == "integrator" || key.name == "links" || key.name == "elements_per_link") {
    throw InputError(
        fmt::format("{} {}: an axis of a map is a number that may have any value "
                    "between two others",
                    flag, key.name));
  }
  solver::with_key(key.name, [&] { protocol::check_ends(key, from, to); });
  if (is_logarithmic && from <= 0.0) {
    throw InputError(fmt::format("{} {}: a logarithmic axis begins above 0", flag, text));
  }
  return {&key, from, to, is_logarithmic};
}

/// Which region a point belongs to.
struct Regions {
  std::string column;
  std::optional<double> level = {};
  std::vector<std::string> names = {};
  std::unordered_map<std::string, int> numbers = {};

  int number_of(const protocol::Value& value) {
    const auto [found, is_new] =
        numbers.try_emplace(name_of(value), static_cast<int>(names.size()));
    if (is_new) {
      names.push_back(found->first);
    }
    return found->second;
  }

 private:
  std::string name_of(const protocol::Value& value) const {
    if (std::holds_alternative<std::monostate>(value)) {
      return "failed";
    }
    if (!level) {
      return std::get<std::string>(value);
    }
    const double number = std::holds_alternative<double>(value)
                              ? std::get<double>(value)
                              : static_cast<double>(std::get<std::int64_t>(value));
    return fmt::format("{} {} {}", column,
                       number > *level ? ">" : "<=", solver::exact_number(*level));
  }
};

/// A column of numbers. Throws InputError for another one.
void check_number_column(const char* flag, const std::string& name) {
  const auto kind = server::kind_of_values(name);
  if (kind != protocol::CellKind::kReal && kind != protocol::CellKind::kInteger) {
    throw InputError(fmt::format(
        "{} {}: no output of that name is a number; `oblique columns` lists all", flag, name));
  }
}

Regions regions_of(const std::string& of) {
  if (of == "mode" || of == "major_mode") {
    return {.column = of};
  }
  const auto equals = of.find('=');
  const auto level =
      equals == std::string::npos ? std::nullopt : solver::number_of(of.substr(equals + 1));
  if (!level || !std::isfinite(*level)) {
    throw InputError(
        fmt::format("--of {}: write mode, major_mode, or COLUMN=LEVEL, as stick_total_s=0", of));
  }
  check_number_column("--of", of.substr(0, equals));
  return {.column = of.substr(0, equals), .level = level};
}

/// The plane of a map: the values that all points share, and the axes.
struct Plane {
  solver::ModelParameters model;
  std::vector<protocol::Axis> constants = {};  ///< of one value each, or expressions
};

/// The model and the keys with one value of a stored study, and what the flags override.
protocol::Recipe recipe_of_study(const MapFlags& flags, const protocol::Recipe& stored,
                                 const std::map<std::string, std::string>& overriding) {
  if (flags.points.preset != PointFlags().preset || !flags.points.lengths.empty()) {
    throw InputError("--preset and --lengths are those of the study: leave them out");
  }
  std::map<std::string, protocol::Axis> axes;
  CsvFiles files(".");
  for (const auto& [key, text] : overriding) {
    axes.emplace(key,
                 axis_of_flag(protocol::axis_key(key), text, protocol::BlockKind::kProduct, files));
  }
  for (const auto& block : stored.blocks()) {
    for (const auto& axis : block.axes()) {
      const auto [known, is_new] = axes.try_emplace(axis.key(), axis);
      const bool is_same = known->second.SerializeAsString() == axis.SerializeAsString();
      if (!overriding.contains(axis.key()) && (!is_same || protocol::axis_size(axis) != 1)) {
        throw InputError(fmt::format("the study \"{}\" has several values of {}: give one with {}",
                                     flags.study, axis.key(), flag_of_key(axis.key())));
      }
    }
  }
  protocol::Recipe recipe;
  *recipe.mutable_model() = stored.model();
  std::vector<protocol::Axis> all;
  for (auto& [key, axis] : axes) {
    all.push_back(std::move(axis));
  }
  *recipe.add_blocks() = protocol::block_of(std::move(all));
  return recipe;
}

/// Throws InputError for values that no point may have, those at the ends of the axes included.
/// `stored`: the recipe of the study that the flags name.
Plane plane_of(Console& console, const MapFlags& flags, const protocol::Recipe& stored,
               const std::array<AxisFlag, 2>& axes) {
  auto points = flags.points;
  for (const auto& axis : axes) {
    const auto [place, is_new] = points.axes.try_emplace(
        std::string(axis.key->name),
        fmt::format("{},{}", solver::exact_number(axis.from), solver::exact_number(axis.to)));
    if (!is_new) {
      throw InputError(fmt::format("{} is an axis of the map: leave {} out", axis.key->name,
                                   flag_of_key(axis.key->name)));
    }
  }
  const auto check_reach = tip_reach(console);
  const auto recipe = flags.study.empty() ? recipe_of_flags(points, check_reach)
                                          : recipe_of_study(flags, stored, points.axes);
  const protocol::PointTable table(recipe);
  check_reach(table);
  check_points(table, flags.study.empty() ? places_of(points) : Places{});
  Plane plane{.model = protocol::from_message(recipe.model())};
  for (const auto& axis : recipe.blocks(0).axes()) {
    if (axis.key() == axes[0].key->name || axis.key() == axes[1].key->name) {
      continue;
    }
    if (protocol::axis_size(axis) != 1 || axis.has_distribution()) {
      throw InputError(
          fmt::format("{} has several values, and a map needs one", flag_of_key(axis.key())));
    }
    plane.constants.push_back(axis);
  }
  return plane;
}

// ---- Solving ----

/// Solves the points of a map, round by round.
class MapSolver {
 public:
  MapSolver(GrowingStudy& study, const FoundMap& map, const Plane& plane, Regions& regions,
            std::string over)
      : study_(study), map_(map), plane_(plane), regions_(regions), over_(std::move(over)) {}

  void solve(BorderSearch& search) {
    auto points = search.next();
    search.set_regions(grid_regions());
    for (points = search.next(); !points.empty(); points = search.next()) {
      search.set_regions(listed_regions(points, 0));
    }
  }

  void solve_on_finer_mesh(ShiftSearch& search, int elements_per_link) {
    for (auto points = search.next(); !points.empty(); points = search.next()) {
      search.set_regions(listed_regions(points, elements_per_link));
    }
  }

  /// Values of --over at the points of the grid, row by row from the lowest; NaN: none.
  const std::vector<double>& grid_values() const { return grid_values_; }

 private:
  std::string what() const {
    constexpr std::uint32_t kOtherRounds = 60;  // of single cells, and on another mesh
    return fmt::format("round {} of about {}", study_.rounds() + 1,
                       map_.grid.halvings + kOtherRounds);
  }

  protocol::Block block_of_lists(const std::vector<double>& x, const std::vector<double>& y) const {
    std::vector<protocol::Axis> axes{
        protocol::listed_axis(protocol::axis_key(map_.axes[0].key()), x),
        protocol::listed_axis(protocol::axis_key(map_.axes[1].key()), y)};
    axes.insert(axes.end(), plane_.constants.begin(), plane_.constants.end());
    return protocol::block_of(std::move(axes));
  }

  /// The coarse grid is a product of two short lists.
  std::vector<int> grid_regions() {
    const std::size_t side = std::size_t{map_.grid.cells} + 1;
    std::array<std::vector<double>, 2> values;
    for (std::uint32_t i = 0; i < side; ++i) {
      for (std::size_t axis : {0U, 1U}) {
        values.at(axis).push_back(map_.axes.at(axis).value(i * map_.grid.cell()));
      }
    }
    const auto columns = regions_.column + (over_.empty() ? "" : ", " + over_);
    const auto rows = study_.solve(block_of_lists(values[0], values[1]), columns, what()).rows;
    // The first axis of a block varies slowest.
    const bool is_x_slow =
        protocol::key_number(map_.axes[0].key()) < protocol::key_number(map_.axes[1].key());
    std::vector<int> found;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto& row = rows[is_x_slow ? i % side * side + i / side : i];
      found.push_back(regions_.number_of(row.front()));
      if (!over_.empty()) {
        const auto* real = std::get_if<double>(&row.back());
        const auto* whole = std::get_if<std::int64_t>(&row.back());
        grid_values_.push_back(real != nullptr    ? *real
                               : whole != nullptr ? static_cast<double>(*whole)
                                                  : std::numeric_limits<double>::quiet_NaN());
      }
    }
    return found;
  }

  /// `elements_per_link` 0: those of the model.
  std::vector<int> listed_regions(const std::vector<LatticePoint>& points, int elements_per_link) {
    std::vector<double> x;
    std::vector<double> y;
    for (const auto& point : points) {
      x.push_back(map_.axes[0].value(point.x));
      y.push_back(map_.axes[1].value(point.y));
    }
    auto block = block_of_lists(x, y);
    if (elements_per_link > 0) {
      std::vector<protocol::Axis> axes(block.axes().begin(), block.axes().end());
      axes.push_back(protocol::listed_axis(protocol::axis_key("elements_per_link"),
                                           {static_cast<double>(elements_per_link)}));
      block = protocol::block_of(std::move(axes));
    }
    block.set_zip(true);
    std::vector<int> found;
    for (const auto& row : study_.solve(block, regions_.column, what()).rows) {
      found.push_back(regions_.number_of(row.front()));
    }
    return found;
  }

  GrowingStudy& study_;
  const FoundMap& map_;
  const Plane& plane_;
  Regions& regions_;
  std::string over_;
  std::vector<double> grid_values_;
};

std::vector<CurveShift> shifts_of_curves(const std::vector<ShiftSearch::Shift>& shifts,
                                         std::size_t curves) {
  std::vector<CurveShift> all(curves);
  std::vector<std::vector<double>> found(curves);
  for (const auto& shift : shifts) {
    ++all[shift.curve].checked;
    if (shift.shift) {
      found[shift.curve].push_back(*shift.shift);
    } else {
      ++all[shift.curve].lost;
    }
  }
  for (std::size_t i = 0; i < curves; ++i) {
    std::sort(found[i].begin(), found[i].end());
    if (!found[i].empty()) {
      all[i].median = found[i][found[i].size() / 2];
      all[i].largest = found[i].back();
    }
  }
  return all;
}

void set_regions(FoundMap& map, const BorderSearch& search, const Regions& regions) {
  map.names = regions.names;
  for (const auto& [region, cells] : search.areas()) {
    map.regions.push_back({regions.names[static_cast<std::size_t>(region)], cells});
  }
  std::stable_sort(map.regions.begin(), map.regions.end(),
                   [](const auto& one, const auto& other) { return one.cells > other.cells; });
  constexpr std::size_t kRasterCells = 256;
  map.raster_cells = kRasterCells;
  const double step = static_cast<double>(map.grid.last()) / kRasterCells;
  for (std::size_t y = 0; y < kRasterCells; ++y) {
    for (std::size_t x = 0; x < kRasterCells; ++x) {
      map.raster.push_back(search.region_at(
          {(static_cast<double>(x) + 0.5) * step, (static_cast<double>(y) + 0.5) * step}));
    }
  }
}

/// The settings that decide which points are solved.
std::string settings_text(const MapFlags& flags, const Plane& plane,
                          const std::array<AxisFlag, 2>& axes) {
  std::string text = protocol::canonical_model(plane.model);
  for (const auto& axis : plane.constants) {
    text += '\n' + axis.SerializeAsString();
  }
  for (const auto& axis : axes) {
    text += fmt::format("\n{} {} {} {}", axis.key->name, solver::exact_number(axis.from),
                        solver::exact_number(axis.to), axis.is_logarithmic);
  }
  return text + fmt::format("\n{} {} {} {}", flags.of, flags.cells,
                            solver::exact_number(flags.bracket), flags.check);
}

MapAxis map_axis(const AxisFlag& flag, const MapGrid& grid) {
  return {*flag.key, flag.from, flag.to, flag.is_logarithmic, grid};
}

FoundMap find_map(Console& console, const MapFlags& flags, protocol::StopSignals& stop) {
  const auto stored = flags.study.empty()
                          ? protocol::Recipe()
                          : stored_recipe(console, flags.explore.source, flags.study);
  const std::array<AxisFlag, 2> axes{axis_flag("--x", flags.x), axis_flag("--y", flags.y)};
  auto regions = regions_of(flags.of);
  if (!flags.over.empty()) {
    check_number_column("--over", flags.over);
  }
  const Plane plane = plane_of(console, flags, stored, axes);
  const auto grid = MapGrid::of(flags.cells, flags.bracket);
  FoundMap map{.study = explored_name(flags.explore, "map", settings_text(flags, plane, axes)),
               .of = flags.of,
               .axes = {map_axis(axes[0], grid), map_axis(axes[1], grid)},
               .grid = grid,
               .bracket = flags.bracket,
               .over_name = flags.over};
  GrowingStudy study(console, flags.explore, map.study, plane.model, stop);
  MapSolver solver(study, map, plane, regions, flags.over);
  BorderSearch search(grid);
  solver.solve(search);
  map.borders = search.borders();
  if (flags.check > 0) {
    ShiftSearch shifts(grid, map.borders, flags.check);
    solver.solve_on_finer_mesh(shifts, 2 * plane.model.elements_per_link);
    map.shifts = shifts_of_curves(shifts.shifts(), map.borders.curves.size());
  }
  map.over = solver.grid_values();
  map.points = study.points();
  map.rounds = study.rounds();
  set_regions(map, search, regions);
  return map;
}

// ---- Output ----

/// Whether the file is data, by its ending; else it is a picture. Throws InputError for another
/// ending.
std::optional<Format> data_format(const std::string& file) {
  for (const auto format : {Format::kCsv, Format::kJson}) {
    if (file.ends_with(format == Format::kCsv ? ".csv" : ".json")) {
      return format;
    }
  }
  static_cast<void>(plot::picture_format({}, file));
  return std::nullopt;
}

std::string map_text(const FoundMap& map, Format format) {
  return format == Format::kCsv    ? map_csv(map)
         : format == Format::kJson ? map_json(map)
                                   : map_table(map);
}

void write_map(const FoundMap& map, const std::string& file) {
  if (const auto format = data_format(file)) {
    AtomicFile out(file);
    out.append(map_text(map, *format));
    out.finish();
    return;
  }
  const auto format = plot::picture_format({}, file);
  plot::write_picture(plot::picture_of(map_figure(map), format), format, file);
}

void check_map_flags(const MapFlags& flags) {
  constexpr std::uint32_t kMostCells = 1024;
  constexpr double kLeastBracket = 1e-8;
  if (flags.cells < 2 || flags.cells > kMostCells) {
    throw InputError(
        fmt::format("--cells {} is not allowed: it must be from 2 to {}", flags.cells, kMostCells));
  }
  if (!(flags.bracket >= kLeastBracket && flags.bracket <= 1.0 / flags.cells)) {
    throw InputError(fmt::format(
        "--bracket {} is not allowed: it must be from {} to 1/{}, a cell's part of an axis",
        solver::exact_number(flags.bracket), solver::exact_number(kLeastBracket), flags.cells));
  }
  static_cast<void>(format_named(flags.format, kFormats));
  for (const auto& file : flags.out) {
    static_cast<void>(data_format(file));
  }
}

int run_map(const MapFlags& flags, Console& console) {
  check_map_flags(flags);
  return run_exploration(console, [&](protocol::StopSignals& stop) {
    const auto found = find_map(console, flags, stop);
    for (const auto& file : flags.out) {
      write_map(found, file);
    }
    console.out() << map_text(found, format_named(flags.format, kFormats));
    console.note(fmt::format("The points are the study {}.", found.study));
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
  command.add_option("--x", flags.x, "horizontal axis")->type_name("KEY=FROM:TO[:log]");
  command.add_option("--y", flags.y, "vertical axis")->type_name("KEY=FROM:TO[:log]");
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
  command
      .add_option("--check", flags.check,
                  "search one of N vertices again on twice as many elements a link; 0: none")
      ->type_name("N")
      ->capture_default_str();
  command.add_option("--over", flags.over, "colour the picture by this output")
      ->type_name("COLUMN");
  protocol::note_choices(command.add_option("--format", flags.format, "table, csv or json")
                             ->type_name("FORMAT")
                             ->capture_default_str(),
                         kFormats);
  command
      .add_option("--out", flags.out,
                  "file: a picture (svg, pdf, png, gp) or data (csv, json) as its name ends")
      ->type_name("FILE");
  add_explore_flags(command, flags.explore);
  add_point_flags(command, flags.points, FlagValues::kOne);
}

}  // namespace oblique::client
