#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/explore/answer.h"
#include "client/explore/growing_study.h"
#include "client/explore/outputs.h"
#include "client/explore/sensitivity.h"
#include "client/io/console.h"
#include "client/io/row_output.h"
#include "client/plot/figure.h"
#include "client/study/point_flags.h"
#include "client/trace/solve_again.h"
#include "proto/program/usage.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/recipe/sampling.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

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
constexpr std::uint64_t kSeed = 1;

struct SensitivityFlags {
  PointFlags points;
  std::string of{"fn_peak_N,duration_s"};
  std::string method{kMethods.front()};
  std::uint64_t rows = 0;  ///< of the first round; 0: by the method
  double interval = 0.02;
  ExploreFlags explore;
  AnswerFlags answer;
};

/// What the flags request, checked.
struct SensitivityProblem {
  bool is_sobol = true;                  ///< false: Morris' method
  protocol::Recipe sample;               ///< a sample with the distributions of the inputs
  std::vector<std::string> inputs = {};  ///< keys whose values are drawn
  /// Of each input the value at coordinate 0 < u < 1.
  std::vector<std::function<double(double u)>> values_at = {};
  std::vector<std::string> outputs = {};
  std::uint64_t first_rows = 0;

  /// The points of rows [begin, end) of the design.
  protocol::Block block_of_rows(std::uint64_t begin, std::uint64_t end) const {
    const std::size_t d = inputs.size();
    std::vector<std::vector<double>> values(d);
    for (std::uint64_t number = begin; number < end; ++number) {
      const auto row =
          is_sobol ? saltelli_row(d, kSeed, number) : morris_trajectory(d, kSeed, number);
      for (std::size_t i = 0; i < row.size(); ++i) {
        values[i % d].push_back(values_at[i % d](row[i]));
      }
    }
    std::vector<protocol::Axis> axes;
    std::size_t input = 0;
    for (const auto& axis : sample.blocks(0).axes()) {
      axes.push_back(protocol::is_drawn(axis)
                         ? protocol::listed_axis(protocol::axis_key(axis.key()), values[input++])
                         : axis);
    }
    auto block = protocol::block_of(std::move(axes));
    block.set_zip(true);
    return block;
  }
};

/// Throws solver::InputError for invalid flags.
SensitivityProblem problem_of(const SensitivityFlags& flags, const ReachCheck& check_reach) {
  check(flags.answer);
  SensitivityProblem problem;
  problem.is_sobol = choice_of("--method", flags.method, kMethods) == 0;
  problem.outputs = outputs_of_flag(flags.of, false);
  if (!(flags.interval > 0.0)) {
    throw solver::InputError("--interval must be above 0");
  }
  problem.first_rows = std::bit_ceil(flags.rows > 0 ? flags.rows : problem.is_sobol ? 512 : 32);
  PointFlags points = flags.points;
  points.sample = fmt::format("sobol:{}", problem.first_rows);
  try {
    problem.sample = recipe_of_flags(points, check_reach);
  } catch (const solver::InputError& error) {
    if (error.fields().key == "sample") {  // not a flag of this command
      throw solver::InputError(
          "no value is drawn: give at least one key a distribution or several values, such as --mu "
          "0.05:1.9");
    }
    throw;
  }
  for (const auto& axis : problem.sample.blocks(0).axes()) {
    if (!protocol::is_drawn(axis)) {
      continue;
    }
    problem.inputs.push_back(axis.key());
    if (axis.has_distribution()) {
      problem.values_at.emplace_back(
          [quantiles = sampling::Quantiles(axis)](double u) { return quantiles.value_at(u); });
    } else {
      problem.values_at.emplace_back([axis](double u) {
        const auto levels = static_cast<double>(protocol::axis_size(axis));
        return protocol::axis_value(axis, static_cast<std::uint64_t>(u * levels));
      });
    }
  }
  if (problem.is_sobol && problem.inputs.size() > kMaxSobolInputs) {
    throw solver::InputError(
        fmt::format("--method sobol allows {} inputs, not {}: find those that matter with --method "
                    "morris, and give the others one value",
                    kMaxSobolInputs, problem.inputs.size()));
  }
  return problem;
}

/// Prints a note if falls need most of the time of the points of `block`.
void note_falls(Console& console, const SensitivityProblem& problem, const protocol::Block& block) {
  constexpr std::uint64_t kContactsPerFall = 100;  // in the time of a fall, or more, on any mesh
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
  constexpr std::uint64_t kMaxValues = 1'900'000;  // that the definition of a study can list
  const std::uint64_t max_points = std::min(kMaxPoints, kMaxValues / problem.inputs.size());
  const auto columns = fmt::format("{}", fmt::join(problem.outputs, ", "));
  std::vector<std::vector<double>> values(problem.outputs.size());
  std::string of_rounds;
  for (std::uint64_t begin = 0, end = problem.first_rows;; begin = end, end *= 2) {
    const auto block = problem.block_of_rows(begin, end);
    if (begin == 0) {
      note_falls(console, problem, block);
    }
    const auto table =
        study.solve(block, columns, fmt::format("round {}{}", study.rounds() + 1, of_rounds));
    std::vector<Sensitivity> found;
    double half_width = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      for (const auto& row : table.rows) {
        values[i].push_back(number_in(row[i]));
      }
      const auto estimate = problem.is_sobol ? sobol_indices : morris_effects;
      found.push_back(estimate(values[i], problem.inputs.size(), kSeed));
      half_width = std::max(half_width, found.back().half_width());
    }
    if (!problem.is_sobol || half_width <= interval) {
      return found;
    }
    if (2 * end * (problem.inputs.size() + 2) > max_points) {
      console.note(
          fmt::format("Note: the widest interval is ± {} instead of ± {}: twice as many "
                      "points would be more than {}.",
                      solver::readable_number(half_width, 2), solver::readable_number(interval),
                      format_count(max_points)));
      return found;
    }
    // The width falls as the square root of the rows.
    of_rounds = fmt::format(" of about {}", static_cast<double>(study.rounds()) +
                                                std::ceil(2.0 * std::log2(half_width / interval)));
  }
}

/// A row for each output and input.
protocol::Table rows_of(const SensitivityProblem& problem, const std::vector<Sensitivity>& found) {
  protocol::Table table{.columns = {"output", "input"}};
  for (const Measure& measure : found.front().measures) {
    append_columns(table, measure.name);
  }
  table.columns.insert(table.columns.end(), {"rows", "dropped"});
  for (std::size_t output = 0; output < problem.outputs.size(); ++output) {
    const Sensitivity& sensitivity = found[output];
    for (std::size_t i = 0; i < problem.inputs.size(); ++i) {
      auto& row =
          table.rows.emplace_back(protocol::Row{problem.outputs[output], problem.inputs[i]});
      for (const Measure& measure : sensitivity.measures) {
        append_values(row, measure.of_inputs[i]);
      }
      row.emplace_back(static_cast<std::int64_t>(sensitivity.rows));
      row.emplace_back(static_cast<std::int64_t>(sensitivity.dropped));
    }
  }
  return table;
}

/// Bars with intervals: a row of two panels for each output, with its first two measures.
plot::Figure figure_of(const SensitivityProblem& problem, const std::vector<Sensitivity>& found,
                       std::uint64_t points) {
  plot::Figure figure{
      .title = problem.is_sobol ? "Sobol\u2019 indices" : "Morris\u2019 elementary effects",
      .subtitle = fmt::format("{} points, 95 % intervals", format_count(points)),
      .columns = 2,
      .panel_size = {400.0, 90.0 + 26.0 * static_cast<double>(problem.inputs.size())}};
  for (std::size_t output = 0; output < problem.outputs.size(); ++output) {
    for (std::size_t i = 0; i < 2; ++i) {
      const Measure& measure = found[output].measures[i];
      plot::Panel panel{.title = problem.outputs[output],
                        .x = {.label = measure.name, .name = measure.name},
                        .y = {.name = "input"},
                        .bars = plot::Bars{.names = problem.inputs}};
      plot::Range range{0.0, problem.is_sobol ? 1.0 : 0.0};
      for (const Estimate& estimate : measure.of_inputs) {
        panel.bars->heights.push_back(std::isnan(estimate.value) ? 0.0 : estimate.value);
        panel.bars->intervals.push_back({estimate.from, estimate.to});
        range = {std::fmin(range.from, estimate.from), std::fmax(range.to, estimate.to)};
      }
      panel.x.span(range, 0.02);
      figure.panels.push_back(std::move(panel));
    }
  }
  return figure;
}

int sensitivity(const SensitivityFlags& flags, Console& console) {
  const SensitivityProblem problem = problem_of(flags, tip_reach(console));
  const std::string settings = fmt::format("{} {}", protocol::recipe_digest(problem.sample),
                                           problem.is_sobol ? kMethods[0] : kMethods[1]);
  return run_exploration(console, [&](protocol::StopSignals& stop) {
    GrowingStudy study(console, flags.explore,
                       explored_name(flags.explore, "sensitivity", settings),
                       protocol::from_message(problem.sample.model()), stop);
    const auto found = sensitivities_of(console, problem, flags.interval, study);
    put_out(console, flags.answer,
            answer_of({{"study", study.name()},
                       {"method", flags.method},
                       {"inputs", problem.inputs},
                       {"points", study.points()}},
                      rows_of(problem, found), figure_of(problem, found, study.points())));
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
      ->check(protocol::whole_number_from(2))
      ->type_name("N");
  command
      .add_option("--interval", flags.interval,
                  "double the rows until each index is known to ± HALF: half the width of its 95 % "
                  "interval")
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
