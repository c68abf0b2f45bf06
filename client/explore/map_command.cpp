#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
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
#include "client/explore/answer.h"
#include "client/explore/growing_study.h"
#include "client/explore/map.h"
#include "client/explore/map_output.h"
#include "client/explore/outputs.h"
#include "client/study/point_flags.h"
#include "client/trace/solve_again.h"
#include "proto/recipe/blocks.h"
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

/// --x or --y.
struct AxisFlag {
  std::string key;
  double from;
  double to;

  /// Parses KEY=FROM:TO. Throws InputError, naming the flag.
  AxisFlag(const char* flag, const std::string& text) {
    const auto equals = std::min(text.find('='), text.size());
    const auto ends =
        protocol::split(std::string_view(text).substr(std::min(equals + 1, text.size())), ':');
    const auto first = solver::number_of(ends.front());
    const auto second = solver::number_of(ends.back());
    if (ends.size() != 2 || !first || !second) {
      throw InputError(fmt::format(
          "{} is required as KEY=FROM:TO, for example mu=0.05:2; got \"{}\"", flag, text));
    }
    key = text.substr(0, equals);
    from = *first;
    to = *second;
    protocol::check_ends(protocol::axis_key(key), from, to);
  }
};

/// What tells regions apart: texts, or numbers up to and above a level.
struct RegionRule {
  std::string output;
  std::optional<double> level = {};

  /// Parses --of. Throws InputError.
  static RegionRule of_flag(const std::string& text) {
    const auto equals = text.rfind('=');
    const auto outputs = outputs_of_flag(text.substr(0, equals), true);
    RegionRule rule{outputs.front()};
    if (equals != std::string::npos) {
      rule.level = solver::number_of(text.substr(equals + 1));
    }
    const bool is_text = server::kind_of_values(rule.output) == protocol::CellKind::kText;
    if (outputs.size() != 1 || rule.level.has_value() == is_text) {
      throw InputError(fmt::format(
          "--of {}: write mode, major_mode, or COLUMN=LEVEL, as stick_total_s=0", text));
    }
    return rule;
  }
  std::string name_of(const protocol::Value& value) const {
    if (std::holds_alternative<std::monostate>(value)) {
      return "failed";
    }
    return level ? fmt::format("{} {} {}", output,
                               number_in(value) > *level ? ">" : "<=", solver::exact_number(*level))
                 : std::get<std::string>(value);
  }
};

// ---- The points of a map ----

/// Adds the model and the keys with one value of a stored study, except for keys that are given.
void take_from_study(PointFlags& flags, const protocol::Recipe& stored, const std::string& study) {
  if (flags.preset != PointFlags().preset || !flags.lengths.empty()) {
    throw InputError("--preset and --lengths are those of the study: leave them out");
  }
  const auto given = flags.axes;
  for (const auto& block : stored.blocks()) {
    for (const auto& axis : block.axes()) {
      const bool is_one = protocol::has_own_values(axis) && protocol::axis_size(axis) == 1;
      const std::string text =
          is_one ? solver::exact_number(protocol::axis_value(axis, 0)) : axis.expression();
      if (!given.contains(axis.key()) &&
          (text.empty() || flags.axes.try_emplace(axis.key(), text).first->second != text)) {
        throw InputError(fmt::format("the study \"{}\" has several values of {}: give one with {}",
                                     study, axis.key(), flag_of_key(axis.key())));
      }
    }
  }
  const auto model = protocol::from_message(stored.model());
  for (const auto& key : solver::model_keys()) {
    if (key.name == "integrator") {
      flags.axes.try_emplace("integrator", solver::integrator_name(model.integrator));
    } else if (key.name != "links" && key.name != "length") {
      flags.axes.try_emplace(std::string(key.name), solver::exact_number(key.get(model)));
    }
  }
  for (const double length_m : model.lengths_m) {
    flags.lengths += (flags.lengths.empty() ? "" : ",") + solver::exact_number(length_m);
  }
}

/// What all points of a map share.
struct MapPlane {
  std::array<AxisFlag, 2> axes;
  solver::ModelParameters model = {};
  std::vector<protocol::Axis> constants = {};  ///< of one value each, or expressions

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
};

/// Throws InputError for a value that no point may have, also at the ends of the axes.
MapPlane plane_of(Console& console, const MapFlags& flags) {
  // An unknown study is reported before other flags, as in all commands.
  const auto stored = flags.study.empty()
                          ? std::optional<protocol::Recipe>()
                          : stored_recipe(console, flags.explore.source, flags.study);
  MapPlane plane{.axes = {AxisFlag{"--x", flags.x}, AxisFlag{"--y", flags.y}}};
  auto points = flags.points;
  for (const auto& [key, from, to] : plane.axes) {
    const auto ends = fmt::format("{},{}", solver::exact_number(from), solver::exact_number(to));
    if (!points.axes.try_emplace(key, ends).second) {
      throw InputError(
          fmt::format("{} is an axis of the map: leave {} out", key, flag_of_key(key)));
    }
  }
  if (stored) {
    take_from_study(points, *stored, flags.study);
  }
  const auto recipe = recipe_of_flags(points, tip_reach(console));
  check_points(protocol::PointTable(recipe), places_of(points));
  plane.model = protocol::from_message(recipe.model());
  for (const auto& axis : recipe.blocks(0).axes()) {
    if (axis.key() == plane.axes[0].key || axis.key() == plane.axes[1].key) {
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

/// Solves the points of a map, round by round.
class MapSolver {
 public:
  MapSolver(GrowingStudy& study, const FoundMap& map, const MapPlane& plane, const RegionRule& rule)
      : study_(study), map_(map), plane_(plane), rule_(rule) {}

  /// Rows of the rule's output and, if any, those of `more`. `elements_per_link` 0: of the model.
  std::vector<protocol::Row> solve(const std::vector<LatticePoint>& points, int elements_per_link,
                                   const std::string& more = {}) {
    std::array<std::vector<double>, 2> values;
    for (const auto& [x, y] : points) {
      values[0].push_back(map_.axes[0].value(x));
      values[1].push_back(map_.axes[1].value(y));
    }
    auto axes = plane_.constants;
    for (const std::size_t axis : {0U, 1U}) {
      axes.push_back(
          protocol::listed_axis(protocol::axis_key(plane_.axes.at(axis).key), values.at(axis)));
    }
    if (elements_per_link > 0) {
      axes.push_back(protocol::listed_axis(protocol::axis_key("elements_per_link"),
                                           {static_cast<double>(elements_per_link)}));
    }
    auto block = protocol::block_of(std::move(axes));
    block.set_zip(true);
    constexpr std::uint32_t kOtherRounds = 50;  // of halved cells and of the finer mesh
    return study_
        .solve(block, rule_.output + (more.empty() ? "" : ", " + more),
               fmt::format("round {} of about {}", study_.rounds() + 1,
                           map_.grid.halvings + kOtherRounds))
        .rows;
  }

  std::vector<int> regions_of(const std::vector<protocol::Row>& rows) {
    std::vector<int> regions;
    for (const auto& row : rows) {
      const auto [found, is_new] =
          numbers_.try_emplace(rule_.name_of(row.front()), static_cast<int>(names_.size()));
      if (is_new) {
        names_.push_back(found->first);
      }
      regions.push_back(found->second);
    }
    return regions;
  }
  const std::vector<std::string>& names() const { return names_; }

 private:
  GrowingStudy& study_;
  const FoundMap& map_;
  const MapPlane& plane_;
  const RegionRule& rule_;
  std::vector<std::string> names_;
  std::unordered_map<std::string, int> numbers_;
};

/// Numbers the regions by their areas, the largest first.
void set_regions(FoundMap& map, const std::vector<std::string>& names) {
  std::vector<std::size_t> pixels(names.size());
  for (const int region : map.borders.raster) {
    ++pixels[static_cast<std::size_t>(region)];
  }
  std::vector<std::size_t> order(names.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](auto one, auto other) { return pixels[one] > pixels[other]; });
  const double cells_of_pixel = std::pow(static_cast<double>(map.grid.cells) / Borders::kRaster, 2);
  std::vector<int> numbers(names.size());
  for (const std::size_t region : order) {
    numbers[region] = static_cast<int>(map.regions.size());
    map.regions.push_back({names[region], cells_of_pixel * static_cast<double>(pixels[region])});
  }
  const auto renumber = [&](int& region) { region = numbers[static_cast<std::size_t>(region)]; };
  std::for_each(map.borders.raster.begin(), map.borders.raster.end(), renumber);
  for (auto& vertex : map.borders.vertices) {
    renumber(vertex.from);
    renumber(vertex.to);
  }
}

FoundMap find_map(Console& console, const MapFlags& flags, protocol::StopSignals& stop) {
  const auto rule = RegionRule::of_flag(flags.of);
  const auto over = flags.over.empty() ? std::vector<std::string>()
                                       : outputs_of_flag(flags.over, false, "--over");
  const MapPlane plane = plane_of(console, flags);
  const auto grid = MapGrid::of(flags.cells, flags.bracket);
  const auto axis_of = [&](const AxisFlag& axis) {
    return MapAxis(axis.key, axis.from, axis.to, grid);
  };
  FoundMap map{.study = explored_name(flags.explore, "map", plane.settings(flags)),
               .of = flags.of,
               .axes = {axis_of(plane.axes[0]), axis_of(plane.axes[1])},
               .grid = grid,
               .bracket = flags.bracket,
               .over_name = flags.over};
  GrowingStudy study(console, flags.explore, map.study, plane.model, stop);
  MapSolver solver(study, map, plane, rule);
  map.borders = find_borders(grid, [&](const std::vector<LatticePoint>& points) {
    const bool is_grid = study.rounds() == 0 && !over.empty();
    const auto rows = solver.solve(points, 0, is_grid ? over.front() : "");
    for (std::size_t i = 0; is_grid && i < rows.size(); ++i) {
      map.over.push_back(number_in(rows[i].back()));
    }
    return solver.regions_of(rows);
  });
  constexpr std::size_t kEvery = 16;
  map.shifts = find_shifts(grid, map.borders, kEvery, [&](const std::vector<LatticePoint>& points) {
    return solver.regions_of(solver.solve(points, 2 * plane.model.elements_per_link));
  });
  map.points = study.points();
  map.rounds = study.rounds();
  set_regions(map, solver.names());
  return map;
}

void check_map_flags(const MapFlags& flags) {
  constexpr std::uint32_t kMaxCells = 512;  // whose points fit into the definition of a study
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
  check(flags.answer);
}

int run_map(const MapFlags& flags, Console& console) {
  check_map_flags(flags);
  return run_exploration(console, [&](protocol::StopSignals& stop) {
    const auto found = find_map(console, flags, stop);
    put_out(console, flags.answer, answer_of(found));
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
