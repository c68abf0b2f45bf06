#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/explore/answer.h"
#include "client/explore/growing_study.h"
#include "client/explore/outputs.h"
#include "client/explore/sensitivity.h"
#include "client/io/row_output.h"
#include "client/study/point_flags.h"
#include "client/trace/solve_again.h"
#include "proto/recipe/model_message.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

constexpr const char* kSensitivityExamples = R"help(Examples:
  oblique sensitivity --H 0.3:1.1 --mu 0.05:1.9 --e "normal(0.8,0.05,0.5,1)"
  oblique sensitivity --H 1 --mu 0.05:1.9 --e 0.5:1 --k "log-uniform(1e7,1e8)" --out indices.svg
  oblique sensitivity --H 1 --mu 0.05:1.9 --e 0.5:1 --of "stick_total_s,major_mode = 'sC sR'"
  oblique sensitivity --H 1 --mu 0.05:1.9 --e 0.5:1 --E 6e10:8e10:16 --preset paper
  oblique sensitivity --H 1 --mu 0.05:1.9 --e 0.5:1 --tip-mass 0:0.02 --rho 2600:2800 --method morris

Inputs are the keys whose VALUES are drawn, independently: FROM:TO, normal(MEAN,SD),
normal(MEAN,SD,FROM,TO), uniform(FROM,TO), log-uniform(FROM,TO), or levels, all equally likely: a
list or FROM:TO:COUNT. sobol solves d + 2 points per row for d inputs. It estimates the part of the
variance that each input explains alone (first) and with all others (total), and doubles the rows
until the intervals are narrow enough. morris solves d + 1 points per trajectory and shows which
inputs matter at all. Intervals are 95 %. Each value of keys other than H, mu, e, k and eta2 needs a
fall of its own: give such keys levels, such as 6e10:8e10:16.)help";

constexpr std::array<std::string_view, 2> kMethods{"sobol", "morris"};
constexpr const char* kMorrisNote =
    "\nmu_star: mean magnitude of the effects; sigma: their standard deviation; mu: their mean\n";

constexpr std::uint64_t kSeed = 1;

struct SensitivityFlags {
  PointFlags points;
  std::string of{"fn_peak_N,duration_s"};
  std::string method{kMethods.front()};
  std::uint64_t rows = 0;  ///< rows of the first round; 0: default of the method
  double interval = 0.02;
  ExploreFlags explore;
  AnswerFlags answer;
};

/// What the flags request, checked.
struct SensitivityProblem {
  bool is_sobol;             ///< false: Morris' method
  std::uint64_t first_rows;  ///< number of rows in the first round
  std::vector<std::string> outputs;
  protocol::Recipe sample = {};          ///< defines the distributions of the inputs
  std::vector<std::string> inputs = {};  ///< keys whose values are drawn
};

/// Throws solver::InputError for invalid flags.
SensitivityProblem problem_of(const SensitivityFlags& flags, const ReachCheck& check_reach) {
  check(flags.answer);
  const bool is_sobol = choice_of("--method", flags.method, kMethods) == 0;
  if (!is_sobol && flags.interval != SensitivityFlags().interval) {
    throw solver::InputError("--interval is for --method sobol: morris solves --rows trajectories");
  }
  const std::uint64_t usual_rows = is_sobol ? 512 : 32;
  SensitivityProblem problem{.is_sobol = is_sobol,
                             .first_rows = std::bit_ceil(flags.rows > 0 ? flags.rows : usual_rows),
                             .outputs = outputs_of_flag(flags.of, false)};
  PointFlags points = flags.points;
  points.sample = fmt::format("random:{}", problem.first_rows);
  try {
    problem.sample = recipe_of_flags(points, check_reach);
  } catch (const solver::InputError& error) {
    constexpr const char* kNothingDrawn =
        "no value is drawn: give at least one key a distribution or several values, such as --mu "
        "0.05:1.9";
    throw error.fields().key == "sample" ? solver::InputError(kNothingDrawn) : error;
  }
  protocol::Block& block = *problem.sample.mutable_blocks(0);
  // Always the same kind, because it changes the digest in the study's name.
  block.mutable_sample()->set_kind(protocol::SAMPLE_SOBOL);
  for (const auto& axis : block.axes()) {
    if (protocol::is_drawn(axis)) {
      problem.inputs.push_back(axis.key());
    }
  }
  if (is_sobol && problem.inputs.size() > kMaxSobolInputs) {
    throw solver::InputError(
        fmt::format("--method sobol allows {} inputs, not {}: find those that matter with --method "
                    "morris, and give the others one value",
                    kMaxSobolInputs, problem.inputs.size()));
  }
  return problem;
}

/// The points of rows [begin, end) of the design, and their coordinates. That of a level is its
/// distance from the least level, where the largest level has 1; that of another value is its
/// probability.
std::pair<protocol::Block, std::vector<double>> rows_of_design(const SensitivityProblem& problem,
                                                               std::uint64_t begin,
                                                               std::uint64_t end) {
  const std::size_t d = problem.inputs.size();
  std::vector<double> coordinates;
  for (std::uint64_t number = begin; number < end; ++number) {
    const auto row = (problem.is_sobol ? saltelli_row : morris_trajectory)(d, kSeed, number);
    coordinates.insert(coordinates.end(), row.begin(), row.end());
  }
  protocol::Block block = problem.sample.blocks(0);
  block.clear_sample();
  block.set_zip(true);
  std::size_t input = 0;
  for (auto& axis : *block.mutable_axes()) {
    if (!protocol::is_drawn(axis)) {
      continue;
    }
    std::vector<double> levels;
    for (std::uint64_t i = 0; !axis.has_distribution() && i < protocol::axis_size(axis); ++i) {
      levels.push_back(protocol::axis_value(axis, i));
    }
    const auto [least, largest] = std::minmax_element(levels.begin(), levels.end());
    std::vector<double> values;
    for (std::size_t i = input++; i < coordinates.size(); i += d) {
      double& at = coordinates[i];
      if (levels.empty()) {
        values.push_back(sampling::Quantiles(axis).value_at(at));
      } else {
        values.push_back(levels[static_cast<std::size_t>(at * static_cast<double>(levels.size()))]);
        at = (values.back() - *least) / (*largest - *least);
      }
    }
    axis = protocol::listed_axis(protocol::axis_key(axis.key()), values);
  }
  return {block, coordinates};
}

/// Prints a note if falls need most of the time of the points of `block`.
void note_falls(Console& console, const SensitivityProblem& problem, const protocol::Block& block) {
  constexpr std::uint64_t kContactsPerFall = 100;  // a fall takes at least as long as 100 contacts
  protocol::Recipe recipe = problem.sample;
  *recipe.mutable_blocks(0) = block;
  const auto size = protocol::size_of(protocol::PointTable(recipe));
  if (size.falls > 1 && size.falls * kContactsPerFall > size.points) {
    console.note(fmt::format(
        "Note: falls take most of the time, {} for the {} points of the first round. Points that "
        "differ only in H, mu, e, k and eta2 share a fall: give other keys levels, such as "
        "6e10:8e10:16.",
        format_count(size.falls), format_count(size.points)));
  }
}

/// The sensitivities of each output. Solves rounds, each with as many rows as all before, until the
/// intervals are narrow enough or the next round would exceed a limit.
std::vector<Sensitivity> sensitivities_of(Console& console, const SensitivityProblem& problem,
                                          double interval, GrowingStudy& study) {
  constexpr std::uint64_t kMaxPoints = 500'000;
  constexpr std::uint64_t kMaxValues = 1'900'000;  // limit of the values in a study's definition
  const std::uint64_t max_points = std::min(kMaxPoints, kMaxValues / problem.inputs.size());
  std::vector<std::vector<double>> values(problem.outputs.size());
  std::string of_rounds;
  for (std::uint64_t begin = 0, end = problem.first_rows;; begin = end, end *= 2) {
    const auto [block, coordinates] = rows_of_design(problem, begin, end);
    if (begin == 0) {
      note_falls(console, problem, block);
    }
    const auto table = study.solve(block, fmt::format("{}", fmt::join(problem.outputs, ", ")),
                                   fmt::format("round {}{}", study.rounds() + 1, of_rounds));
    std::vector<Sensitivity> found;
    double half_width = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      for (const auto& row : table.rows) {
        values[i].push_back(number_in(row[i]));
      }
      found.push_back(problem.is_sobol
                          ? sobol_indices(values[i], problem.inputs.size(), kSeed)
                          : morris_effects(values[i], coordinates, problem.inputs.size(), kSeed));
      for (const Measure& measure : found.back().measures) {
        for (const Estimate& estimate : measure.of_inputs) {
          half_width = std::fmax(half_width, estimate.half_width());  // ignores NaN
        }
      }
    }
    if (!problem.is_sobol || half_width <= interval) {
      return found;
    }
    if (2 * end * (problem.inputs.size() + 2) > max_points) {
      console.note(fmt::format(
          "Note: the widest interval is ± {} instead of ± {}: twice as many points would be more "
          "than {}.",
          solver::readable_number(half_width, 2), solver::readable_number(interval),
          format_count(max_points)));
      return found;
    }
    // The width is proportional to 1 / sqrt(number of rows).
    const double more_rounds = std::ceil(2.0 * std::log2(half_width / interval));
    of_rounds = fmt::format(" of about {}", static_cast<double>(study.rounds()) + more_rounds);
  }
}

/// The answer has a row, and two bars with intervals, for each output and input. Throws
/// std::runtime_error if no output has a row.
Answer sensitivity_answer(const SensitivityProblem& problem, const std::vector<Sensitivity>& found,
                          const GrowingStudy& study) {
  protocol::Table table{.columns = {"output", "input"}};
  for (const Measure& measure : found.front().measures) {
    append_columns(table, measure.name);
  }
  table.columns.insert(table.columns.end(), {"rows", "dropped"});
  plot::Figure figure{
      .title = problem.is_sobol ? "Sobol\u2019 indices" : "Morris\u2019 elementary effects",
      .subtitle = fmt::format("{} points, 95 % intervals", format_count(study.points())),
      .columns = 2,
      .panel_size = {400.0, 90.0 + 26.0 * static_cast<double>(problem.inputs.size())}};
  ValueNotes notes;
  for (std::size_t output = 0; output < found.size(); ++output) {
    const auto& [measures, rows, dropped] = found[output];
    bool varies = false;
    for (std::size_t i = 0; i < problem.inputs.size(); ++i) {
      protocol::Row row{problem.outputs[output], problem.inputs[i]};
      for (const Measure& measure : measures) {
        append_values(row, measure.of_inputs[i]);
        varies = varies || std::abs(measure.of_inputs[i].value) > 0.0;
      }
      row.insert(row.end(), {static_cast<std::int64_t>(rows), static_cast<std::int64_t>(dropped)});
      table.rows.push_back(std::move(row));
    }
    for (const Measure& measure : std::span(measures).first(2)) {
      plot::Panel panel{.title = problem.outputs[output],
                        .x = {.label = measure.name, .name = measure.name},
                        .y = {.name = "input"},
                        .bars = plot::Bars{.names = problem.inputs}};
      plot::Range range{0.0, problem.is_sobol ? 1.0 : 0.0};
      for (const auto& [value, from, to] : measure.of_inputs) {
        panel.bars->heights.push_back(std::isnan(value) ? 0.0 : value);
        panel.bars->intervals.push_back({from, to});
        range = {std::fmin(range.from, from), std::fmax(range.to, to)};
      }
      panel.x.span(range, 0.02);
      figure.panels.push_back(std::move(panel));
    }
    notes.add(problem.outputs[output], rows, rows + dropped, varies);
  }
  notes.end(first_failure(study.source(), study.name()));
  auto answer = answer_of({{"study", study.name()},
                           {"method", problem.is_sobol ? kMethods[0] : kMethods[1]},
                           {"inputs", problem.inputs},
                           {"points", study.points()}},
                          std::move(table), std::move(figure), notes.notes);
  answer.tables += problem.is_sobol ? "" : kMorrisNote;
  return answer;
}

int sensitivity(const SensitivityFlags& flags, Console& console) {
  const SensitivityProblem problem = problem_of(flags, tip_reach(console));
  const std::string settings =
      fmt::format("{} {}", protocol::recipe_digest(problem.sample), flags.method);
  return run_exploration(console, [&](protocol::StopSignals& stop) {
    GrowingStudy study(console, flags.explore,
                       explored_name(flags.explore, "sensitivity", settings),
                       protocol::from_message(problem.sample.model()), stop);
    const auto found = sensitivities_of(console, problem, flags.interval, study);
    put_out(console, flags.answer, sensitivity_answer(problem, found, study));
    return kDone;
  });
}

}  // namespace

void add_sensitivity(CLI::App& app, Action& parsed) {
  auto [command, flags] = new_command(
      app, parsed, "sensitivity", "Find which inputs matter: Sobol' indices or Morris' screening",
      kSensitivityExamples, sensitivity);
  command.add_option("--of", flags.of, kOutputsHelp)->type_name("OUTPUTS")->capture_default_str();
  auto* method = command
                     .add_option("--method", flags.method,
                                 "sobol: indices; morris: elementary effects, for many inputs")
                     ->type_name("NAME")
                     ->capture_default_str();
  protocol::note_choices(method, kMethods);
  command
      .add_option("--rows", flags.rows,
                  "rows of the first round (default 512) or trajectories (default 32), rounded up "
                  "to a power of two")
      ->check(CLI::Range(2, 100'000))
      ->type_name("N");
  command
      .add_option("--interval", flags.interval,
                  "double the rows until each index is known to ± HALF: half the width of its 95 % "
                  "interval")
      ->check(protocol::number_between(1e-9, 1e9))
      ->type_name("HALF")
      ->capture_default_str();
  add_answer_flags(command, flags.answer);
  add_explore_flags(command, flags.explore);
  add_point_flags(command, flags.points, FlagValues::kMany);
  for (const char* of_studies : {"--zip", "--sample", "--where"}) {
    command.remove_option(command.get_option(of_studies));
  }
}

}  // namespace oblique::client
