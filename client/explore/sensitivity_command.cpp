#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/study_time.h"
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
  oblique sensitivity --H 1 --mu 0.05:1.9 --e 0.5:1 --of "stick_total_s,major_mode:'sC sR'"
  oblique sensitivity --H 1 --mu 0.05:1.9 --e 0.5:1 --E 6e10:8e10:16 --preset paper
  oblique sensitivity --H 1 --mu 0.05:1.9 --e 0.5:1 --tip-mass 0:0.02 --rho 2600:2800 --method morris

Inputs are the keys whose VALUES are drawn: FROM:TO, normal(MEAN,SD), normal(MEAN,SD,FROM,TO),
uniform(FROM,TO), log-uniform(FROM,TO), or a list or a range of levels, each as likely. They are
independent. sobol needs d + 2 points a row for d inputs and gives the parts of the variance that each
input explains alone (first order) and with all others (total); morris needs d + 1 points a
trajectory and shows which inputs matter at all. Intervals are 95 %.
Values of keys other than H, mu, e, k and eta2 cost a fall each: give them as levels, as 6e10:8e10:16.
Ctrl-C stops it and loses nothing: the same command again goes on where it stopped.)help";

enum class SensitivityMethod { kSobol, kMorris };
constexpr std::array<std::string_view, 2> kSensitivityMethods{"sobol", "morris"};

struct SensitivityFlags {
  PointFlags points;
  std::string of{"fn_peak_N,duration_s"};
  std::string method{kSensitivityMethods.front()};
  std::uint64_t rows = 0;  ///< of the first round; 0: by the method
  double interval = 0.02;
  std::uint64_t most_points = 500'000;
  std::int64_t seed = 1;
  ExploreFlags explore;
  AnswerFlags answer;
};

/// An input: a key whose values are drawn.
struct DrawnInput {
  protocol::Axis axis;
  std::optional<sampling::Quantiles> quantiles = {};  ///< none: it has levels

  /// The value at coordinate 0 < u < 1.
  double at(double u) const {
    const std::uint64_t levels = protocol::axis_size(axis);
    return quantiles
               ? quantiles->value_at(u)
               : protocol::axis_value(
                     axis, std::min(static_cast<std::uint64_t>(u * static_cast<double>(levels)),
                                    levels - 1));
  }
};

/// A checked request: study, inputs and outputs.
struct SensitivityProblem {
  SensitivityMethod method = SensitivityMethod::kSobol;
  protocol::Recipe sample;  ///< a sample with the distributions of the inputs
  std::vector<DrawnInput> inputs = {};
  std::vector<Output> outputs = {};
  std::uint64_t first_rows = 0;
  std::uint64_t seed = 1;

  std::size_t points_of_row() const {
    return inputs.size() + (method == SensitivityMethod::kSobol ? 2 : 1);
  }
  /// Coordinates of the points of a row of the design.
  std::vector<double> row(std::uint64_t number) const {
    return method == SensitivityMethod::kSobol
               ? saltelli_row(inputs.size(), seed, number)
               : morris_trajectory(inputs.size(), seed, number).points;
  }
};

std::uint64_t first_rows_of(const SensitivityFlags& flags, SensitivityMethod method) {
  constexpr std::uint64_t kSobolRows = 512;
  constexpr std::uint64_t kTrajectories = 32;
  if (flags.rows == 0) {
    return method == SensitivityMethod::kSobol ? kSobolRows : kTrajectories;
  }
  if (method == SensitivityMethod::kSobol && !std::has_single_bit(flags.rows)) {
    throw solver::InputError(
        fmt::format("--points {} is not allowed: points of Sobol's sequence are balanced in powers "
                    "of two only; "
                    "take {} or {}",
                    flags.rows, std::bit_floor(flags.rows), std::bit_ceil(flags.rows)));
  }
  return flags.rows;
}

/// Throws solver::InputError for flags that are invalid or contradict each other.
SensitivityProblem problem_of(const SensitivityFlags& flags, const ReachCheck& check_reach) {
  SensitivityProblem problem;
  problem.method =
      static_cast<SensitivityMethod>(choice_of("--method", flags.method, kSensitivityMethods));
  problem.first_rows = first_rows_of(flags, problem.method);
  problem.outputs = outputs_of_flag("--of", flags.of);
  for (const Output& output : problem.outputs) {
    refuse_texts("--of", output);
  }
  if (!(flags.interval > 0.0)) {
    throw solver::InputError("--interval must be above 0: half the width of the widest interval");
  }
  PointFlags points = flags.points;
  points.sample = fmt::format("sobol:{}:{}", problem.first_rows, flags.seed);
  try {
    problem.sample = recipe_of_flags(points, check_reach);
  } catch (const solver::InputError& error) {
    if (error.fields().key == "sample") {  // it is not among the flags
      throw solver::InputError(
          "no value is drawn: give at least one key a distribution or several values, as --mu "
          "0.05:1.9");
    }
    throw;
  }
  problem.seed = problem.sample.blocks(0).sample().seed();
  for (const auto& axis : problem.sample.blocks(0).axes()) {
    if (protocol::is_drawn(axis)) {
      problem.inputs.push_back({.axis = axis});
      if (axis.has_distribution()) {
        problem.inputs.back().quantiles.emplace(axis);
      }
    }
  }
  if (problem.method == SensitivityMethod::kSobol && problem.inputs.size() > kMostSobolInputs) {
    throw solver::InputError(fmt::format(
        "{} inputs are more than the {} that sobol can have: find those that matter with --method "
        "morris, and give the others one value",
        problem.inputs.size(), kMostSobolInputs));
  }
  return problem;
}

/// The points of rows [begin, end) of the design, side by side.
protocol::Block block_of_rows(const SensitivityProblem& problem, std::uint64_t begin,
                              std::uint64_t end) {
  const std::size_t d = problem.inputs.size();
  std::vector<std::vector<double>> values(d);
  for (std::uint64_t number = begin; number < end; ++number) {
    const auto row = problem.row(number);
    for (std::size_t i = 0; i < row.size(); ++i) {
      values[i % d].push_back(problem.inputs[i % d].at(row[i]));
    }
  }
  std::vector<protocol::Axis> axes;
  std::size_t input = 0;
  for (const auto& axis : problem.sample.blocks(0).axes()) {
    axes.push_back(protocol::is_drawn(axis)
                       ? protocol::listed_axis(protocol::axis_key(axis.key()), values[input++])
                       : axis);
  }
  auto block = protocol::block_of(std::move(axes));
  block.set_zip(true);
  return block;
}

/// Sixteen equally likely levels instead of a distribution, as a flag.
std::string levels_flag(const DrawnInput& input) {
  constexpr int kSuggested = 16;
  std::vector<std::string> levels;
  for (int level = 0; level < kSuggested; ++level) {
    levels.push_back(solver::readable_number(input.at((level + 0.5) / kSuggested), 5));
  }
  const bool is_uniform =
      input.axis.distribution().kind() == protocol::DistributionKind::DISTRIBUTION_UNIFORM;
  return fmt::format("{} {}", flag_of_key(input.axis.key()),
                     is_uniform ? fmt::format("{}:{}:{}", levels.front(), levels.back(), kSuggested)
                                : fmt::format("{}", fmt::join(levels, ",")));
}

/// Prints a note if most of the time of these points goes to falls that levels would share.
void note_falls(Console& console, const SensitivityProblem& problem, const protocol::Block& block) {
  constexpr std::uint64_t kFew = 100;  // contacts, which take less time than a fall on any mesh
  const auto model = protocol::from_message(problem.sample.model());
  std::vector<std::string> flags;
  for (const DrawnInput& input : problem.inputs) {
    const std::size_t key = protocol::key_number(input.axis.key());
    if (input.quantiles && !protocol::is_point_key(key) &&
        solver::changes_fall(protocol::key_numbered(key), model)) {
      flags.push_back(levels_flag(input));
    }
  }
  protocol::Recipe recipe = problem.sample;
  *recipe.mutable_blocks(0) = block;
  const protocol::PointTable table(recipe);
  const auto size = protocol::size_of(table);
  if (flags.empty() || size.falls * kFew < size.points) {
    return;
  }
  const auto cost = measured_cost(table, size);
  auto with_one_fall = size;
  with_one_fall.falls = 1;
  const double share = 1.0 - time_s(cost, with_one_fall) / time_s(cost, size);
  if (share > 0.5) {
    console.note(fmt::format(
        "Note: {:.0f} % of the time, about {} for the first round, is {} falls: each drawn value "
        "needs its own. Levels share them: {}.",
        100.0 * share, format_duration(time_s(cost, size)), format_count(size.falls),
        fmt::join(flags, " ")));
  }
}

/// One measure of all inputs.
struct Measure {
  std::string name;     ///< in CSV and JSON
  std::string heading;  ///< in tables and pictures
  std::vector<Estimate> of_inputs;
};

/// The measures of one output.
struct OutputMeasures {
  const Output* output;
  std::uint64_t rows;
  std::uint64_t dropped;
  double mean;      ///< NaN: not estimated
  double variance;  ///< likewise
  std::vector<Measure> measures;

  double widest() const {
    double half_width = 0.0;
    for (const Measure& measure : measures) {
      for (const Estimate& estimate : measure.of_inputs) {
        half_width = std::fmax(half_width, estimate.half_width());  // NaN counts for nothing
      }
    }
    return half_width;
  }
};

OutputMeasures measures_of(const SensitivityProblem& problem, const Output& output,
                           const std::vector<double>& values) {
  const std::size_t d = problem.inputs.size();
  if (problem.method == SensitivityMethod::kMorris) {
    auto effects = morris_effects(values, d, problem.seed);
    return {&output,
            effects.trajectories,
            effects.dropped,
            kNaN,
            kNaN,
            {{"mu_star", "mean of magnitudes", std::move(effects.mu_star)},
             {"sigma", "deviation", std::move(effects.sigma)},
             {"mu", "mean", std::move(effects.mu)}}};
  }
  auto indices = sobol_indices(values, d, problem.seed);
  return {&output,
          indices.rows,
          indices.dropped,
          indices.mean,
          indices.variance,
          {{"first", "first order", std::move(indices.first)},
           {"total", "total", std::move(indices.total)}}};
}

/// The design solved so far.
struct SolvedDesign {
  std::uint64_t rows = 0;
  std::uint64_t points = 0;
  std::uint64_t failed = 0;
  std::vector<std::vector<double>> values = {};  ///< of each output, NaN where there is none
  std::vector<OutputMeasures> measures = {};

  double widest() const {
    double half_width = 0.0;
    for (const auto& each : measures) {
      half_width = std::max(half_width, each.widest());
    }
    return half_width;
  }
};

void add_rows(SolvedDesign& solved, const SensitivityProblem& problem,
              const protocol::Table& table) {
  solved.values.resize(problem.outputs.size());
  for (const auto& row : table.rows) {
    ++solved.points;
    solved.failed += std::holds_alternative<std::monostate>(row.front()) ? 1U : 0U;
    for (std::size_t i = 0; i < problem.outputs.size(); ++i) {
      solved.values[i].push_back(number_of(row.at(i + 1), "--of", problem.outputs[i]));
    }
  }
  solved.measures.clear();
  for (std::size_t i = 0; i < problem.outputs.size(); ++i) {
    solved.measures.push_back(measures_of(problem, problem.outputs[i], solved.values[i]));
  }
}

/// Solves round after round, each with as many rows as all before, until the intervals are narrow
/// enough or the next round would exceed a limit.
SolvedDesign solved_design(Console& console, const SensitivityProblem& problem,
                           const SensitivityFlags& flags, GrowingStudy& study) {
  constexpr std::uint64_t kListedBytes =
      15'000'000;  // of 16 MiB that a study's definition may have
  const std::uint64_t most_points =
      std::min(flags.most_points, kListedBytes / (8 * problem.inputs.size()));
  std::vector<std::string> columns{"H"};  // NULL where the point failed
  for (const Output& output : problem.outputs) {
    columns.push_back(output.sql);
  }
  SolvedDesign solved;
  std::string of_rounds;
  for (std::uint64_t end = problem.first_rows; solved.rows < end; end = 2 * solved.rows) {
    if (end * problem.points_of_row() > most_points) {
      if (solved.rows == 0) {
        throw solver::InputError(
            fmt::format("--points {} needs {} points for {} inputs, more than {}",
                        problem.first_rows, format_count(end * problem.points_of_row()),
                        problem.inputs.size(), format_count(most_points)));
      }
      console.note(fmt::format(
          "Note: the widest interval is +-{} instead of +-{}: twice as many points would be more "
          "than {}.",
          solver::readable_number(solved.widest(), 2), solver::readable_number(flags.interval),
          format_count(most_points)));
      break;
    }
    const auto block = block_of_rows(problem, solved.rows, end);
    if (solved.rows == 0) {
      note_falls(console, problem, block);
    }
    add_rows(solved, problem,
             study.solve(block, fmt::format("{}", fmt::join(columns, ", ")),
                         fmt::format("round {}{}", study.rounds() + 1, of_rounds)));
    solved.rows = end;
    if (problem.method == SensitivityMethod::kMorris || solved.widest() <= flags.interval) {
      break;
    }
    // The width falls as the root of the rows.
    const double rounds = std::ceil(2.0 * std::log2(solved.widest() / flags.interval));
    of_rounds = fmt::format(" of about {}", static_cast<double>(study.rounds()) + rounds);
  }
  return solved;
}

std::vector<std::string> names_of(const SensitivityProblem& problem) {
  std::vector<std::string> names;
  for (const DrawnInput& input : problem.inputs) {
    names.push_back(input.axis.key());
  }
  return names;
}

std::string tables_of(const SensitivityProblem& problem, const SolvedDesign& solved) {
  const auto names = names_of(problem);
  const bool is_sobol = problem.method == SensitivityMethod::kSobol;
  const auto shown = [is_sobol](double value) {
    return is_sobol ? solver::fixed_number(value, 3) : solver::readable_number(value, 4);
  };
  std::string text;
  for (const auto& each : solved.measures) {
    text += fmt::format("{}{}: ", text.empty() ? "" : "\n", each.output->name);
    if (!std::isnan(each.mean)) {
      text += fmt::format("mean {}, deviation {}, ", solver::readable_number(each.mean),
                          solver::readable_number(std::sqrt(each.variance), 4));
    }
    text += fmt::format("{} {}", format_count(each.rows), is_sobol ? "rows" : "trajectories");
    text += each.dropped == 0 ? "\n"
                              : fmt::format(", {} left out, in which a point has no value\n",
                                            format_count(each.dropped));
    protocol::Table table{.columns = {"input"}};
    for (const auto& measure : each.measures) {
      table.columns.insert(table.columns.end(), {measure.heading, "95 %"});
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      auto& row = table.rows.emplace_back(protocol::Row{names[i]});
      for (const auto& measure : each.measures) {
        const auto& [value, from, to] = measure.of_inputs[i];
        const bool is_known = !std::isnan(value);
        row.push_back(is_known ? protocol::Value(shown(value)) : protocol::Value());
        row.emplace_back(is_known ? fmt::format("{} to {}", shown(from), shown(to)) : "");
      }
    }
    text += text_of(table);
  }
  return text;
}

protocol::Table rows_of(const SensitivityProblem& problem, const SolvedDesign& solved) {
  const auto names = names_of(problem);
  protocol::Table table{.columns = {"output", "input"}};
  for (const auto& measure : solved.measures.front().measures) {
    table.columns.insert(table.columns.end(),
                         {measure.name, measure.name + "_from", measure.name + "_to"});
  }
  table.columns.insert(table.columns.end(), {"rows", "dropped"});
  for (const auto& each : solved.measures) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      auto& row = table.rows.emplace_back(protocol::Row{each.output->name, names[i]});
      for (const auto& measure : each.measures) {
        const Estimate& of_input = measure.of_inputs[i];
        for (const double value : {of_input.value, of_input.from, of_input.to}) {
          row.push_back(value_of(value));
        }
      }
      row.emplace_back(static_cast<std::int64_t>(each.rows));
      row.emplace_back(static_cast<std::int64_t>(each.dropped));
    }
  }
  return table;
}

std::string json_of(const SensitivityProblem& problem, const SolvedDesign& solved,
                    const GrowingStudy& study) {
  nlohmann::ordered_json json{
      {"study", study.name()},
      {"method", kSensitivityMethods.at(static_cast<std::size_t>(problem.method))},
      {"seed", problem.seed},
      {"rows", solved.rows},
      {"points", solved.points},
      {"failed", solved.failed},
      {"inputs", names_of(problem)}};
  for (const auto& each : solved.measures) {
    nlohmann::ordered_json output{
        {"name", each.output->name}, {"rows", each.rows}, {"dropped", each.dropped}};
    if (problem.method == SensitivityMethod::kSobol) {
      output["mean"] = each.mean;
      output["variance"] = each.variance;
    }
    for (const auto& measure : each.measures) {
      output[measure.name] = json_of(measure.of_inputs);
    }
    json["outputs"].push_back(std::move(output));
  }
  return json.dump(2);
}

/// One panel of bars per measure, one row of panels per output.
plot::Figure figure_of(const SensitivityProblem& problem, const SolvedDesign& solved) {
  plot::Figure figure{
      .title = problem.method == SensitivityMethod::kSobol ? "Sobol\u2019 indices"
                                                           : "Morris\u2019 elementary effects",
      .columns = 2,
      .panel_size = {400.0, 90.0 + 26.0 * static_cast<double>(names_of(problem).size())}};
  figure.subtitle = fmt::format("{} points, intervals of 95 %", format_count(solved.points));
  for (const auto& each : solved.measures) {
    for (std::size_t measure = 0; measure < 2; ++measure) {
      const auto& [name, heading, of_inputs] = each.measures[measure];
      plot::Panel panel{.title = fmt::format("{}: {}", each.output->name, heading)};
      panel.x = {.label = heading, .name = name};
      panel.y = {.name = "input"};
      panel.bars = plot::Bars{.names = names_of(problem)};
      plot::Range range{0.0, problem.method == SensitivityMethod::kSobol ? 1.0 : 0.0};
      for (const Estimate& estimate : of_inputs) {
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
  static_cast<void>(choice_of(flags.answer));
  const SensitivityProblem problem = problem_of(flags, tip_reach(console));
  const std::string settings = fmt::format("{} {} {} {}", protocol::recipe_digest(problem.sample),
                                           flags.method, problem.first_rows, problem.seed);
  return run_exploration(console, [&](protocol::StopSignals& stop) {
    GrowingStudy study(console, flags.explore,
                       explored_name(flags.explore, "sensitivity", settings),
                       protocol::from_message(problem.sample.model()), stop);
    const SolvedDesign solved = solved_design(console, problem, flags, study);
    if (solved.failed > 0) {
      console.note(
          fmt::format("Note: {} of {} points failed; `oblique query {} --where \"status = "
                      "'failed'\" --select point,error` shows why.",
                      format_count(solved.failed), format_count(solved.points), study.name()));
    }
    put_out(console, flags.answer,
            {.tables = tables_of(problem, solved),
             .rows = rows_of(problem, solved),
             .json = json_of(problem, solved, study),
             .figure = figure_of(problem, solved)});
    return kDone;
  });
}

}  // namespace

void add_sensitivity(CLI::App& app, Action& parsed) {
  auto [command, flags] = new_command(
      app, parsed, "sensitivity", "Find which inputs matter: Sobol' indices or Morris' screening",
      kSensitivityExamples, sensitivity);
  command.add_option("--of", flags.of, std::string(kOutputsHelp))
      ->type_name("OUTPUTS")
      ->capture_default_str();
  auto* method = command
                     .add_option("--method", flags.method,
                                 "sobol: indices; morris: elementary effects, for many inputs")
                     ->type_name("NAME")
                     ->capture_default_str();
  protocol::note_choices(method, kSensitivityMethods);
  command
      .add_option("--points", flags.rows,
                  "rows of the first round, a power of two, or trajectories; default: 512, or 32")
      ->check(protocol::whole_number_from(2))
      ->type_name("N");
  command
      .add_option("--interval", flags.interval,
                  "add rounds until each index is known to +- this with 95 %")
      ->type_name("HALF")
      ->capture_default_str();
  command.add_option("--max-points", flags.most_points, "most points in all")
      ->check(protocol::whole_number_from(1))
      ->type_name("N")
      ->capture_default_str();
  command
      .add_option("--seed", flags.seed,
                  "seed of the scrambled Sobol sequence, or of Morris' trajectories")
      ->check(protocol::whole_number_from(0))
      ->type_name("N")
      ->capture_default_str();
  add_answer_flags(command, flags.answer);
  add_explore_flags(command, flags.explore);
  add_point_flags(command, flags.points, FlagValues::kMany);
  for (const char* of_studies : {"--zip", "--sample", "--where"}) {
    command.remove_option(command.get_option(of_studies));
  }
}

}  // namespace oblique::client
