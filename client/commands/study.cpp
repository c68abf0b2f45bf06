#include <algorithm>
#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/commands/study_time.h"
#include "client/io/console.h"
#include "client/io/progress.h"
#include "client/study/point_flags.h"
#include "client/study/study.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

constexpr const char* kStudyExamples = R"help(Examples:
  oblique study check deploy/studies/paper.toml
  oblique study check sweep.toml --json
  oblique study check --sample sobol:100000:1 --H 0.3:1.1 --mu "normal(0.4,0.05,0,)" --e 0.9)help";

constexpr const char* kStudyCheckExamples = R"(Examples:
  oblique study check deploy/studies/paper.toml
  oblique study check sweep.toml --json
  oblique study check --H 1 --mu 0.01:2:40:log --e 0.6,0.8,1 --where "mu > 0.5 * e"

Nothing is submitted. The predicted time is that of `oblique run` on this machine:
(falls x time of a fall + points x time of a contact) / threads. Some falls and contacts are timed
for it on all cores, which takes a few seconds on fine meshes. The size is estimated from the
average size of results and models.)";

struct CheckFlags {
  StudyFlags study;
  bool json = false;
  bool no_rate = false;
};

/// A point with its values on the axes of its block, in the order of the axes.
struct ShownPoint {
  std::uint64_t number;
  std::vector<std::pair<std::string, double>> values;
};

struct BlockReport {
  protocol::BlockPlace place;
  protocol::PassingPoints left_in;
  std::string made_of;
  ShownPoint first;
  ShownPoint last;
};

struct Report {
  std::string name;
  std::uint64_t numbers;  ///< number of points, including those that the filter leaves out
  protocol::StudySize size;
  std::vector<BlockReport> blocks;
  std::optional<StudyCost> cost;
};

/// Returns a point with its values. The values are those of the axes, because a model does not have
/// a value for both `length` and `length1`.
ShownPoint shown_point(const protocol::PointTable& table, const protocol::Block& block,
                       std::uint64_t number) {
  ShownPoint shown{number, {}};
  const auto values = table.values(number);
  for (int i = 0; i < block.axes_size(); ++i) {
    shown.values.emplace_back(block.axes(i).key(), values[static_cast<std::size_t>(i)]);
  }
  return shown;
}

/// Describes a block as "H (4) x mu (40) x e": axes, their numbers of values, and derived keys.
std::string made_of(const protocol::Block& block) {
  const std::string_view between = block.zip() || block.has_sample() ? ", " : " x ";
  std::string axes;
  std::string following;
  for (const auto& layout : protocol::layout_of(block)) {
    if (const auto& expression = layout.axis->expression(); !expression.empty()) {
      following += fmt::format("; {} = {}", layout.axis->key(), expression);
      continue;
    }
    axes += fmt::format("{}{}", axes.empty() ? "" : between, layout.axis->key());
    axes += layout.values > 1 ? fmt::format(" ({})", layout.values) : "";
  }
  const std::string kind = block.has_sample()
                               ? fmt::format("{} sample of ", name_of(block.sample().kind()))
                               : (block.zip() ? "side by side " : "");
  return kind + axes + following;
}

/// Returns the last point of the block that the filter keeps. Searches only the last `most` points;
/// if the filter keeps none of them, returns the last point.
std::uint64_t last_left_in(const protocol::PointTable& table, const protocol::BlockPlace& place,
                           std::uint64_t most) {
  const std::uint64_t last = place.first_point + place.points - 1;
  for (std::uint64_t back = 0; back < std::min(most, place.points); ++back) {
    if (table.passes_filter(last - back)) {
      return last - back;
    }
  }
  return last;
}

BlockReport report_of_block(const protocol::PointTable& table, int number,
                            const protocol::PassingPoints& left_in) {
  constexpr std::uint64_t kMaxSearched = 100'000;
  const protocol::Block& block = table.recipe().blocks(number);
  const auto& place = table.block(static_cast<std::size_t>(number));
  const std::uint64_t end = place.first_point + std::min(kMaxSearched, place.points);
  const std::uint64_t first = table.first_passing(place.first_point, end);
  return {place, left_in, made_of(block),
          shown_point(table, block, first < end ? first : place.first_point),
          shown_point(table, block, last_left_in(table, place, kMaxSearched))};
}

Report report_of(const std::string& name, const protocol::PointTable& table) {
  Report report{name, table.size(), protocol::size_of(table), {}, {}};
  for (int i = 0; i < table.recipe().blocks_size(); ++i) {
    report.blocks.push_back(
        report_of_block(table, i, report.size.blocks[static_cast<std::size_t>(i)]));
  }
  return report;
}

std::string shown(const ShownPoint& point) {
  std::string text;
  for (const auto& [key, value] : point.values) {
    text +=
        fmt::format("{}{} = {}", text.empty() ? "" : ", ", key,
                    key == "integrator"
                        ? std::string(solver::integrator_names()[static_cast<std::size_t>(value)])
                        : solver::readable_number(value));
  }
  return text;
}

void print(std::ostream& out, const Report& report, const protocol::Recipe& recipe) {
  const protocol::StudySize& size = report.size;
  out << "study   " << report.name << (recipe.errors() ? ", with estimated errors" : "") << '\n';
  out << "points  " << (size.points_estimated ? "about " : "") << format_count(size.points);
  if (size.points != report.numbers) {
    out << " of " << format_count(report.numbers) << ", kept by where";
  }
  out << "\nmodels  " << format_count(size.models) << ", with "
      << (size.falls_estimated ? "about " : "") << counted(size.falls, "fall", "different falls")
      << '\n';
  for (std::size_t i = 0; i < report.blocks.size(); ++i) {
    const auto& block = report.blocks[i];
    const std::uint64_t last = block.place.first_point + block.place.points - 1;
    out << fmt::format("block {}: {}{}, {}: {}\n", i + 1, block.left_in.estimated ? "about " : "",
                       counted(block.left_in.points, "point", "points"),
                       block.place.points == 1
                           ? fmt::format("number {}", last)
                           : fmt::format("numbers {} to {}", block.place.first_point, last),
                       block.made_of);
    out << fmt::format("  first {}: {}\n", block.first.number, shown(block.first));
    out << fmt::format("  last {}: {}\n", block.last.number, shown(block.last));
  }
  if (report.cost) {
    out << fmt::format(
        "time    {}\n        (timed {} and {}, at the present load of this machine)\n",
        time_in_words(*report.cost, size, recipe),
        counted(report.cost->timed_falls, "fall", "falls"),
        counted(report.cost->timed_points, "contact", "contacts"));
  }
  constexpr std::uint64_t kEmptyDatabaseBytes = 127'000;
  out << fmt::format("size    about {} in a new database, {} more in an existing one\n",
                     format_bytes(kEmptyDatabaseBytes + size.bytes), format_bytes(size.bytes));
}

nlohmann::ordered_json json_of(const ShownPoint& point) {
  nlohmann::ordered_json json{{"point", point.number}};
  for (const auto& [key, value] : point.values) {
    if (key == "integrator") {
      json[key] = solver::integrator_names()[static_cast<std::size_t>(value)];
    } else {
      json[key] = value;
    }
  }
  return json;
}

nlohmann::ordered_json json_of(const Report& report, bool wants_errors) {
  nlohmann::ordered_json json{
      {"study", report.name},         {"errors", wants_errors},
      {"points", report.size.points}, {"points_estimated", report.size.points_estimated},
      {"numbers", report.numbers},    {"models", report.size.models},
      {"falls", report.size.falls},   {"falls_estimated", report.size.falls_estimated}};
  for (const auto& block : report.blocks) {
    json["blocks"].push_back({{"first_point", block.place.first_point},
                              {"numbers", block.place.points},
                              {"points", block.left_in.points},
                              {"models", block.place.models},
                              {"made_of", block.made_of},
                              {"first", json_of(block.first)},
                              {"last", json_of(block.last)}});
  }
  if (report.cost) {
    json["time_s"] = time_s(*report.cost, report.size);
    json["threads"] = report.cost->threads;
    json["solved_points"] = report.cost->timed_points;
    json["solved_falls"] = report.cost->timed_falls;
  }
  json["bytes"] = report.size.bytes;
  return json;
}

int check_study(const CheckFlags& flags, Console& console) {
  const auto study = checked_study(console, flags.study);
  const protocol::PointTable table(study.recipe);
  Report report = report_of(study.name, table);
  if (!flags.no_rate) {
    StatusLine line(console);
    const auto timing = line.begin("timing some falls and contacts of the study");
    report.cost = measured_cost(table, report.size);
  }
  if (flags.json) {
    console.out() << json_of(report, table.wants_errors()).dump(2) << '\n';
  } else {
    print(console.out(), report, table.recipe());
    note_coarse_mesh(console.notes(), table.recipe());
    note_unusual_values(console.notes(), table.recipe());
  }
  return kDone;
}

}  // namespace

void add_study(CLI::App& app, Action& parsed) {
  auto* study = app.add_subcommand("study", "Check a study before it is submitted");
  study->footer(kStudyExamples);
  study->require_subcommand(1);
  auto [command, flags] =
      new_command(*study, parsed, "check",
                  "Print points, predicted time and size of a study, or what is wrong with it",
                  kStudyCheckExamples, check_study);
  command.add_flag("--json", flags.json, "print one JSON object");
  command.add_flag("--no-rate", flags.no_rate, "do not solve points, and predict no time");
  add_study_flags(command, flags.study);
}

}  // namespace oblique::client
