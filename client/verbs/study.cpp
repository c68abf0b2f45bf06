#include <algorithm>
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/output/human_units.h"
#include "client/output/mesh_note.h"
#include "client/output/unjudged_note.h"
#include "client/output/work_line.h"
#include "client/study/fall_count.h"
#include "client/study/study_flags.h"
#include "client/verbs/solving_rate.h"
#include "client/verbs/tip_reach.h"
#include "client/verbs/verbs.h"
#include "proto/program/stop_signals.h"
#include "proto/recipe/block_points.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/written/written_sample.h"
#include "worker/solver/model/number.h"

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

Nothing is submitted. The time is estimated from some points of the study that are solved here, on
all cores, for about a second (of a fine mesh on coarser ones); the size from what a result and a
model take in a database on average.)";

/// What a result takes in a database, on average (server/store/README.md).
constexpr std::uint64_t kBytesAResult = 650;
/// What a model takes there.
constexpr std::uint64_t kBytesAModel = 600;

struct CheckFlags {
  StudyFlags study;
  bool json = false;
  bool no_rate = false;
};

/// A point with the values that it has in the axes of its block, in their order.
struct ShownPoint {
  std::uint64_t number;
  std::vector<std::pair<std::string, double>> values;
};

/// What one block is.
struct BlockReport {
  protocol::BlockPlace place;
  std::uint64_t points;  ///< left in
  std::string made_of;
  ShownPoint first;
  ShownPoint last;
};

struct Report {
  std::string name;
  std::uint64_t numbers;  ///< of points, with those that are left out
  std::uint64_t points;
  std::uint64_t models;
  FallCount falls;
  std::vector<BlockReport> blocks;
  std::vector<std::uint64_t> unjudged;  ///< of the blocks, from 0
  std::optional<SolvingRate> rate;
};

/// The point that was gone to, by the axes, not by the model: of length and length1 both have a
/// value.
ShownPoint shown_point(const protocol::Block& block, const protocol::BlockPoints& points,
                       std::uint64_t number) {
  ShownPoint shown{number, {}};
  for (int i = 0; i < block.axes_size(); ++i) {
    shown.values.emplace_back(block.axes(i).key(), points.values()[static_cast<std::size_t>(i)]);
  }
  return shown;
}

/// "H (4) x mu (40) x e", the axes with their numbers of values, and what follows from them.
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

BlockReport report_of_block(const protocol::PointTable& table, int number) {
  const protocol::Block& block = table.recipe().blocks(number);
  const auto& place = table.block(static_cast<std::size_t>(number));
  const auto base = protocol::from_message(table.recipe().model());
  protocol::BlockPoints points(base, block);  // of its own: nearly all numbers may be gone through
  std::uint64_t first = 0;
  for (points.go_to(first); first + 1 < place.points && !points.is_left_in(); points.go_to(first)) {
    ++first;
  }
  const auto shown_first = shown_point(block, points, place.first_point + first);
  std::uint64_t last = place.points - 1;
  for (points.go_to(last); last > first && !points.is_left_in(); points.go_to(last)) {
    --last;
  }
  return {place, block.has_points_left_in() ? block.points_left_in() : place.points, made_of(block),
          shown_first, shown_point(block, points, place.first_point + last)};
}

/// What the study takes in a database. Points that a filter leaves out bring no model.
std::uint64_t bytes_of(const Report& report) {
  return kBytesAResult * report.points + kBytesAModel * std::min(report.models, report.points);
}

Report report_of(const std::string& name,
                 const std::shared_ptr<const protocol::PointTable>& table) {
  Report report{name,
                table->size(),
                table->points(),
                table->models(),
                count_falls(*table),
                {},
                unjudged_blocks(table->recipe()),
                {}};
  for (int i = 0; i < table->recipe().blocks_size(); ++i) {
    report.blocks.push_back(report_of_block(*table, i));
  }
  return report;
}

/// Falls that are to be solved: an estimate of errors wants a second one, on half the mesh.
std::uint64_t falls_to_solve(const Report& report, bool wants_errors) {
  return std::min(report.falls.falls, report.points) * (wants_errors ? 2 : 1);
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

std::string counted(std::uint64_t count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", shown_count(count), count == 1 ? one : many);
}

void print(const Report& report, bool wants_errors) {
  std::cout << "study   " << report.name << (wants_errors ? ", with estimated errors" : "") << '\n';
  std::cout << "points  " << shown_count(report.points);
  if (report.points != report.numbers) {
    std::cout << " of " << shown_count(report.numbers) << ", left in by where";
  }
  std::cout << "\nmodels  " << shown_count(report.models) << ", with "
            << (report.falls.is_estimate ? "about " : "")
            << counted(report.falls.falls, "fall", "different falls") << '\n';
  for (std::size_t i = 0; i < report.blocks.size(); ++i) {
    const auto& block = report.blocks[i];
    const std::uint64_t last = block.place.first_point + block.place.points - 1;
    std::cout << fmt::format(
        "block {}: {}, {}: {}\n", i + 1, counted(block.points, "point", "points"),
        block.place.points == 1 ? fmt::format("number {}", last)
                                : fmt::format("numbers {} to {}", block.place.first_point, last),
        block.made_of);
    std::cout << fmt::format("  first {}: {}\n", block.first.number, shown(block.first));
    std::cout << fmt::format("  last {}: {}\n", block.last.number, shown(block.last));
  }
  if (report.rate) {
    const auto& rate = *report.rate;
    std::cout << fmt::format(
        "time    about {} on {} here, as busy as it is now ({} and {} were solved{})\n",
        shown_duration(rate.time_s(report.points, falls_to_solve(report, wants_errors))),
        counted(rate.threads, "thread", "threads"), counted(rate.points, "point", "points"),
        counted(rate.falls, "fall", "falls"),
        rate.elements_per_link == 0
            ? ""
            : fmt::format(" on {} elements a link and fewer, and the cost extrapolated",
                          rate.elements_per_link));
  }
  std::cout << fmt::format("size    about {} in a database\n", shown_bytes(bytes_of(report)));
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
  nlohmann::ordered_json json{{"study", report.name},
                              {"errors", wants_errors},
                              {"points", report.points},
                              {"numbers", report.numbers},
                              {"models", report.models},
                              {"falls", report.falls.falls},
                              {"falls_estimated", report.falls.is_estimate}};
  for (const auto& block : report.blocks) {
    json["blocks"].push_back({{"first_point", block.place.first_point},
                              {"numbers", block.place.points},
                              {"points", block.points},
                              {"models", block.place.models},
                              {"made_of", block.made_of},
                              {"first", json_of(block.first)},
                              {"last", json_of(block.last)}});
  }
  json["blocks_not_judged"] = report.unjudged;
  if (report.rate) {
    const auto& rate = *report.rate;
    json["time_s"] = rate.time_s(report.points, falls_to_solve(report, wants_errors));
    json["threads"] = rate.threads;
    json["solved_points"] = rate.points;
    json["solved_falls"] = rate.falls;
    if (rate.elements_per_link != 0) {
      json["extrapolated_from_elements_per_link"] = rate.elements_per_link;
    }
  }
  json["bytes"] = bytes_of(report);
  return json;
}

/// Counts what filters leave in, and judges what only points tell. The exit code when that was
/// stopped by a signal.
std::optional<int> survey(const Study& study, protocol::PointTable& table) {
  if (!table.needs_survey()) {
    return std::nullopt;
  }
  protocol::StopSignals stop;
  WorkLine line;
  const auto counting = line.begin("looking at every point");
  const bool is_done = judge_points(table, study.located, [&stop] { return !stop.requested(); });
  return is_done ? std::nullopt : std::optional(stop.exit_code());
}

int check_study(const CheckFlags& flags) {
  const auto study = study_of_flags(flags.study, tip_reach());
  const auto table = std::make_shared<protocol::PointTable>(study.recipe);
  if (const auto stopped = survey(study, *table)) {
    return *stopped;
  }
  Report report = report_of(study.name, table);
  if (!flags.no_rate) {
    WorkLine line;
    const auto solving = line.begin("solving some points for an estimate of time");
    report.rate = measured_rate(table, 1.0);
  }
  const bool wants_errors = table->wants_errors();
  if (flags.json) {
    std::cout << json_of(report, wants_errors).dump(2) << '\n';
  } else {
    print(report, wants_errors);
    tell_mesh(std::cerr, table->recipe());
    tell_unjudged(std::cerr, table->recipe());
  }
  return kDone;
}

}  // namespace

void add_study(CLI::App& app, Command& command) {
  auto* verb = app.add_subcommand("study", "Look at a study before it is submitted");
  verb->footer(kStudyExamples);
  verb->require_subcommand(1);
  auto flags = std::make_shared<CheckFlags>();
  auto* check = verb->add_subcommand(
      "check", "Say how many points a study has, which, and what they will cost; or what is wrong");
  check->footer(kStudyCheckExamples);
  check->add_flag("--json", flags->json, "print one JSON object");
  check->add_flag("--no-rate", flags->no_rate, "solve no points, and estimate no time");
  add_study_flags(*check, flags->study, command.names_single_lengths);
  check->callback([flags, &command] { command = [flags] { return check_study(*flags); }; });
}

}  // namespace oblique::client
