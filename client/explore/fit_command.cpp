#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/explore/answer.h"
#include "client/explore/fit.h"
#include "client/explore/growing_study.h"
#include "client/explore/measurements.h"
#include "client/explore/outputs.h"
#include "client/explore/paper_fit.h"
#include "client/io/console.h"
#include "client/io/row_output.h"
#include "client/paper/paper_comparison.h"
#include "client/plot/figure.h"
#include "client/study/csv_file.h"
#include "client/study/point_flags.h"
#include "client/trace/solve_again.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"
#include "server/query/columns.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using solver::exact_number;
using solver::fixed_number;
using solver::InputError;
using solver::readable_number;

constexpr const char* kFitExamples = R"(Examples:
  oblique fit measured.csv --fit k=1e7:1e8 --fit eta2=1:2 --preset paper
  oblique fit measured.csv --fit k=1e7:1e8:2.5e7 --sd 1% --e 1 --out fit.svg
  oblique fit measured.csv --fit mu=0.1:1 --format json
  oblique fit                             the paper's numbers: A, I, k and eta2
  oblique fit --from paper --elements-per-link 5

measured.csv has a line with the names of its columns and a line for each impact. Columns are H, mu, e
and model keys, outputs as `oblique columns` names them, and their standard deviations, as
fn_peak_N_sd. What has no column is a flag. Intervals are 95 % profile-likelihood intervals.
Ctrl-C loses nothing: the same command continues.)";

constexpr const char* kUsualFrom = "printed";

struct FitFlags {
  std::string file;
  std::vector<std::string> fit;  ///< "k=1e7:1e8", "k=1e7:1e8:5e7"
  std::string deviation;         ///< of --sd
  bool is_scaled = false;
  PointFlags points;
  ExploreFlags explore;
  AnswerFlags answer;
  std::string from{kUsualFrom};
  bool json = false;
  const CLI::App* command = nullptr;  ///< the parsed command line
};

// ---- The paper's numbers ----

/// Returns the preset of --from with the mesh of the flags. Throws InputError for flags that have
/// no effect without measured numbers.
solver::ModelParameters paper_start(const FitFlags& flags) {
  constexpr const char* kMesh = "elements_per_link";
  constexpr std::array kAllowed{
      "--from", "--elements-per-link", "--json", "--format", "--out", "--quiet", "--verbose"};
  for (const auto* option : flags.command->get_options()) {
    if (option->count() > 0 && std::ranges::count(kAllowed, option->get_name()) == 0) {
      throw InputError(fmt::format(
          "{} needs measured numbers: `oblique fit MEASURED.csv --fit ...`; without a file the "
          "paper's numbers are fitted, with --from, --elements-per-link and the output flags alone",
          option->get_name()));
    }
  }
  if (wants_picture(flags.answer)) {
    throw InputError(fmt::format(
        "--out {}: the fit to the paper's numbers has no picture: end the name with .csv or .json",
        flags.answer.file));
  }
  auto start = solver::preset(flags.from);
  start.elements_per_link = solver::preset("paper").elements_per_link;
  if (const auto mesh = flags.points.axes.find(kMesh); mesh != flags.points.axes.end()) {
    const auto& key = *solver::find_model_key(kMesh);
    const double elements = solver::number_of(mesh->second).value_or(kNaN);
    solver::check_value(key, elements);
    key.set(start, elements);
  }
  solver::validate(start);
  return start;
}

Answer paper_fit_answer(const FitStep& end, const solver::ModelParameters& start) {
  const solver::ModelParameters preset = solver::preset("paper");
  const auto missing = (end.predictions.array() == 0.0).count();
  const double rms_percent = std::sqrt(end.residuals.array().square().mean());
  const double largest_percent = end.residuals.cwiseAbs().maxCoeff();
  nlohmann::ordered_json json = {{"elements_per_link", start.elements_per_link},
                                 {"iterations", end.iteration},
                                 {"published_numbers", end.residuals.size()},
                                 {"missing", missing},
                                 {"rms_percent", rms_percent},
                                 {"largest_percent", largest_percent}};
  protocol::Table table{
      .columns = {"parameter", "start", "fitted", "preset paper", "difference [%]"}};
  for (std::size_t i = 0; i < kFittedKeys.size(); ++i) {
    const auto& key = *solver::find_model_key(kFittedKeys.at(i));
    const std::string name(key.name);
    const double value = end.parameters[static_cast<Index>(i)];
    const double percent = 100.0 * (value / key.get(preset) - 1.0);
    table.rows.push_back({name + (key.unit.empty() ? "" : fmt::format(" [{}]", key.unit)),
                          key.get(start), value, key.get(preset),
                          solver::signed_number(percent, 2)});
    json["fitted"][name] = value;
    json["from_preset_percent"][name] = percent;
  }
  const auto summary = fmt::format(
      "{} published numbers: rms difference {} %, largest {} %{} ({} iterations, n = {})\n",
      end.residuals.size(), fixed_number(rms_percent, 2), fixed_number(largest_percent, 2),
      missing == 0 ? "" : fmt::format(", {} without ours", missing), end.iteration,
      start.elements_per_link);
  return {.tables = text_of(table) + '\n' + summary, .rows = table, .json = json.dump(2)};
}

int fit_to_paper(const FitFlags& flags, Console& console) {
  const auto start = paper_start(flags);
  const auto end = fit_paper(published_table(), start,
                             [&](const std::string& what) { console.notes() << what << '\n'; });
  put_out(console, flags.answer, paper_fit_answer(end, start));
  return kDone;
}

// ---- Measured numbers ----

/// Parses KEY=FROM:TO or KEY=FROM:TO:START.
Unknown unknown_of_flag(const std::string& text) {
  const auto equals = std::min(text.find('='), text.size());
  const auto parts =
      protocol::split(std::string_view(text).substr(std::min(equals + 1, text.size())), ':');
  try {
    if (parts.size() < 2 || parts.size() > 3) {
      throw InputError("write KEY=FROM:TO, as k=1e7:1e8, or KEY=FROM:TO:START");
    }
    std::vector<double> numbers;
    for (const auto part : parts) {
      const auto number = solver::number_of(part);
      if (!number) {
        throw InputError(fmt::format("{:?} is not a number{}", part, solver::why_no_number(part)));
      }
      numbers.push_back(*number);
    }
    const auto& key = protocol::axis_key(text.substr(0, equals));
    Unknown unknown{std::string(key.name), numbers[0], numbers[1], numbers.back()};
    unknown.start = numbers.size() == 3 ? numbers[2] : unknown.value_at(1.5 * std::numbers::pi);
    constexpr double kSomewhere = 0.381966;  // keys of whole numbers are refused
    const double between = unknown.from + kSomewhere * (unknown.to - unknown.from);
    for (const double value : {unknown.from, unknown.to, unknown.start, between}) {
      solver::check_value(key, value);
    }
    return unknown;
  } catch (const InputError& error) {
    throw error.at("--fit " + protocol::excerpt(text));
  }
}

/// Returns 0.01 for the text 1%, and 0 for an empty text.
double relative_deviation(std::string_view text) {
  const auto percent = solver::number_of(text.substr(0, text.find('%')));
  if (!text.empty() && !(text.ends_with('%') && percent > 0.0 && std::isfinite(*percent))) {
    throw InputError(fmt::format("--sd {}: write a positive percentage of each value, as 1%",
                                 protocol::excerpt(text)));
  }
  return percent.value_or(0.0) / 100.0;
}

/// A fit to measurements, with the model and the conditions of its points.
struct MeasuredFit {
  Measurements measured = {};
  FitProblem problem = {};
  solver::ModelParameters model = {};
  /// Axes besides the unknowns, with a value for each row.
  std::vector<std::pair<std::string, std::vector<double>>> conditions = {};
};

/// Adds the model and the conditions. Adds a value of each column and unknown to the flags, so that
/// they are checked like flags.
void add_flags(MeasuredFit& fit, PointFlags points, const ReachCheck& check_reach) {
  const auto given = points.axes;
  const auto add = [&](const std::string& key, double value) {
    if (!points.axes.emplace(key, exact_number(value)).second) {
      throw InputError(fmt::format(
          "{} is given twice: it is a flag, a column of the measurements, or --fit", key));
    }
  };
  for (const auto& [key, values] : fit.measured.conditions) {
    add(key, values.front());
  }
  for (const Unknown& unknown : fit.problem.unknowns) {
    add(unknown.name, unknown.start);
  }
  const auto recipe = recipe_of_flags(points, check_reach);
  fit.model = protocol::from_message(recipe.model());
  fit.conditions = fit.measured.conditions;
  for (const auto& axis : recipe.blocks(0).axes()) {
    if (axis.values_size() != 1) {
      throw InputError(
          fmt::format("{}: fit takes one value; a column of the measurements has one "
                      "for each line",
                      flag_of_key(axis.key())));
    }
    if (given.contains(axis.key())) {
      fit.conditions.emplace_back(axis.key(), std::vector(fit.measured.rows, axis.values(0)));
    }
  }
}

MeasuredFit measured_fit(const FitFlags& flags, const ReachCheck& check_reach) {
  if (flags.fit.empty()) {
    throw InputError("nothing is to be fitted: give --fit KEY=FROM:TO, as --fit k=1e7:1e8");
  }
  MeasuredFit fit;
  CsvFiles files(".");
  fit.measured = read_measurements(files.at(flags.file), relative_deviation(flags.deviation));
  for (const std::string& text : flags.fit) {
    fit.problem.unknowns.push_back(unknown_of_flag(text));
  }
  add_flags(fit, flags.points, check_reach);
  const auto& numbers = fit.measured.numbers;
  fit.problem.measured.resize(static_cast<Index>(numbers.size()));
  fit.problem.sd = fit.problem.measured;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    fit.problem.measured[static_cast<Index>(i)] = numbers[i].value;
    fit.problem.sd[static_cast<Index>(i)] = numbers[i].sd;
    fit.problem.names.push_back(numbers[i].name);
  }
  fit.problem.check();
  return fit;
}

/// Returns the points of all rows of measurements for one parameter vector after another.
protocol::Block block_of(const MeasuredFit& fit, const std::vector<VectorXd>& points) {
  std::vector<std::string> keys;
  std::vector<std::vector<double>> values;
  for (const auto& [key, of_rows] : fit.conditions) {
    keys.push_back(key);
    auto& all = values.emplace_back();
    for (std::size_t point = 0; point < points.size(); ++point) {
      all.insert(all.end(), of_rows.begin(), of_rows.end());
    }
  }
  for (std::size_t i = 0; i < fit.problem.unknowns.size(); ++i) {
    keys.push_back(fit.problem.unknowns[i].name);
    auto& all = values.emplace_back();
    for (const VectorXd& point : points) {
      all.insert(all.end(), fit.measured.rows, point[static_cast<Index>(i)]);
    }
  }
  return listed_points(keys, values);
}

/// Returns the predictions of the measured numbers from the results of a block of `block_of`.
std::vector<VectorXd> predictions_of(const Measurements& measured, const protocol::Table& results) {
  std::vector<VectorXd> predictions;
  for (std::size_t first = 0; first < results.rows.size(); first += measured.rows) {
    std::ranges::transform(
        measured.numbers,
        predictions.emplace_back(static_cast<Index>(measured.numbers.size())).begin(),
        [&](const MeasuredNumber& number) {
          return number_in(results.rows.at(first + number.row)[number.output]);
        });
  }
  return predictions;
}

/// All settings that determine the points. Their digest becomes part of the study's name.
std::string settings_of(const MeasuredFit& fit, const FitFlags& flags) {
  auto text = fmt::format("{} {} {} {}", protocol::canonical_model(fit.model), flags.is_scaled,
                          fmt::join(flags.fit, " "), fmt::join(fit.measured.outputs, " "));
  for (const auto& number : fit.measured.numbers) {
    text += fmt::format(" {} {} {} {}", number.row, number.output, number.value, number.sd);
  }
  for (const auto& [key, values] : fit.conditions) {
    text += fmt::format(" {} {}", key, fmt::join(values, " "));
  }
  return text;
}

// ---- Answer ----

/// Returns "is at its bound 1; values down to 0.977 fit as well." Wider bounds are advised where
/// the key allows them.
std::string bound_note(const Unknown& unknown, const Estimate& fitted) {
  const bool is_lower = fitted.value - unknown.from < unknown.to - fitted.value;
  const double bound = is_lower ? unknown.from : unknown.to;
  const double other = is_lower ? unknown.to : unknown.from;
  const double end = is_lower ? fitted.to : fitted.from;
  const bool may_be_wider =
      protocol::axis_key(unknown.name).is_allowed(bound + 1e-3 * (bound - other));
  return fmt::format("is at its bound {}; {}values {} to {} fit as well.{}", readable_number(bound),
                     std::isnan(end) ? "all " : "", is_lower ? "up" : "down",
                     readable_number(std::isnan(end) ? other : end),
                     may_be_wider ? " Values beyond the bound may fit better." : "");
}

/// Returns sentences about the unknowns that the data do not determine.
std::vector<std::string> notes_of(const std::vector<Unknown>& unknowns, const Fit& fit) {
  std::vector<std::string> notes;
  for (const auto& [numbers, is_undetermined] : fit.combinations) {
    std::string names;
    for (const std::size_t number : numbers) {
      names += (names.empty() ? "" : " and ") + unknowns[number].name;
    }
    notes.push_back(names + (is_undetermined ? " cannot" : " can hardly") +
                    " be told apart by these data.");
  }
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const auto& fitted = fit.unknowns[i];
    const bool has_ends = !std::isnan(fitted.estimate.from) && !std::isnan(fitted.estimate.to);
    const std::string what =
        !fitted.has_effect   ? "has no effect on these data."
        : fitted.is_at_bound ? bound_note(unknowns[i], fitted.estimate)
        : !has_ends          ? "has an interval that reaches a bound, where the end is left empty."
        : fitted.is_cut ? "has an interval that ends where an output jumps, or is missing, because "
                          "the sequence of states changes."
                        : "";
    if (!what.empty()) {
      notes.push_back(fmt::format("{} {}", unknowns[i].name, what));
    }
  }
  const auto degrees = static_cast<double>(fit.degrees_of_freedom);
  if (degrees > 0.0 && fit.minimum.chi2 > degrees + 4.0 * std::sqrt(2.0 * degrees)) {
    notes.emplace_back(
        "chi2 is larger than the deviations explain: they are too small, the model lacks "
        "something, or another start leads to a lower minimum. --scale widens the intervals.");
  }
  if (fit.scale < 1.0) {
    notes.push_back(
        fmt::format("chi2 is small, so --scale narrows sd to {} of its size: leave it out if the "
                    "deviations are known.",
                    readable_number(std::sqrt(fit.scale), 2)));
  }
  return notes;
}

protocol::Table table_of_unknowns(const std::vector<Unknown>& unknowns, const Fit& fit) {
  protocol::Table table{
      .columns = {"unknown", "unit", "from", "to", "start", "value", "sd", "lower_95", "upper_95"}};
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const auto& [name, from, to, start] = unknowns[i];
    const auto& [value, lower, upper] = fit.unknowns[i].estimate;
    table.rows.push_back({name, std::string(protocol::axis_key(name).unit), from, to, start, value,
                          value_of(fit.unknowns[i].sd), value_of(lower), value_of(upper)});
  }
  return table;
}

protocol::Table table_of_residuals(const Measurements& measured, const FitStep& minimum) {
  protocol::Table table{.columns = {"row", "output", "measured", "sd", "fitted", "residual_sd"}};
  for (std::size_t i = 0; i < measured.numbers.size(); ++i) {
    const auto& number = measured.numbers[i];
    table.rows.push_back({static_cast<std::int64_t>(number.row + 1),
                          measured.outputs[number.output], number.value, number.sd,
                          minimum.predictions[static_cast<Index>(i)],
                          minimum.residuals[static_cast<Index>(i)]});
  }
  return table;
}

/// Plots fitted over measured values in a panel per output, and all residuals in another panel.
plot::Figure figure_of(const Measurements& measured, const FitStep& minimum) {
  using Mark = plot::Curve::Mark;
  plot::Figure figure{.title = fmt::format("Fit with chi2 = {}", readable_number(minimum.chi2, 4)),
                      .columns = 2,
                      .panel_size = {480.0, 360.0}};
  plot::Panel residuals{.x = {.label = "row"}, .y = {.label = "residual / standard deviation"}};
  residuals.x.span({1.0, static_cast<double>(measured.rows)}, 0.05);
  residuals.y.span(
      {std::min(-2.0, minimum.residuals.minCoeff()), std::max(2.0, minimum.residuals.maxCoeff())},
      0.05);
  for (std::size_t output = 0; output < measured.outputs.size(); ++output) {
    const std::string& name = measured.outputs[output];
    plot::Curve values{.stroke = output, .mark = Mark::kDots};
    auto& rows = residuals.curves.emplace_back(
        plot::Curve{.name = name, .stroke = output, .mark = Mark::kDots});
    for (std::size_t i = 0; i < measured.numbers.size(); ++i) {
      if (const auto& number = measured.numbers[i]; number.output == output) {
        values.x.push_back(number.value);
        values.y.push_back(minimum.predictions[static_cast<Index>(i)]);
        rows.x.push_back(static_cast<double>(number.row + 1));
        rows.y.push_back(minimum.residuals[static_cast<Index>(i)]);
      }
    }
    plot::Panel panel{.x = plot::axis_of(name, server::unit_of_column(name)), .has_key = false};
    panel.x.span(plot::united(plot::range_of(values.x), plot::range_of(values.y)), 0.05);
    panel.y = panel.x;
    panel.x.label += ", measured";
    panel.y.label += ", fitted";
    const std::vector<double> ends{panel.x.range.from, panel.x.range.to};
    panel.curves = {{.x = ends, .y = ends, .mark = Mark::kBorder}, std::move(values)};
    figure.panels.push_back(std::move(panel));
  }
  figure.panels.push_back(std::move(residuals));
  return figure;
}

Answer fit_answer(const MeasuredFit& fitted, const Fit& fit, const GrowingStudy& study) {
  const auto& unknowns = fitted.problem.unknowns;
  const auto notes = notes_of(unknowns, fit);
  const auto table = table_of_unknowns(unknowns, fit);
  const auto residuals = table_of_residuals(fitted.measured, fit.minimum);
  nlohmann::ordered_json json{
      {"study", study.name()},    {"iterations", fit.minimum.iteration},
      {"rounds", study.rounds()}, {"points", study.points()},
      {"chi2", fit.minimum.chi2}, {"degrees_of_freedom", fit.degrees_of_freedom},
      {"scale", fit.scale},       {"unknowns", json_rows(table)}};
  for (Index i = 0; i < fit.covariance.rows(); ++i) {
    for (Index j = 0; j < fit.covariance.cols(); ++j) {
      json["correlation"][static_cast<std::size_t>(i)].push_back(fit.correlation(i, j));
    }
  }
  json["notes"] = notes;
  json["residuals"] = json_rows(residuals);
  const auto summary =
      fmt::format("chi2 = {} with {}{}", readable_number(fit.minimum.chi2, 4),
                  counted(fit.degrees_of_freedom, "degree of freedom", "degrees of freedom"),
                  fit.scale == 1.0
                      ? ""
                      : fmt::format("; variances are scaled by {}", readable_number(fit.scale, 4)));
  return {.tables = fmt::format("{}\n{}\n{}{}\n{}", text_of(table), summary, fmt::join(notes, "\n"),
                                notes.empty() ? "" : "\n", text_of(residuals)),
          .rows = table,
          .json = json.dump(2),
          .figure = figure_of(fitted.measured, fit.minimum),
          .notes = notes};
}

int fit_to_measurements(const FitFlags& flags, Console& console) {
  if (flags.command->count("--from") > 0) {
    throw InputError(
        "--from is allowed only in a fit to the paper's numbers: use --preset to choose the model");
  }
  auto fitted = measured_fit(flags, tip_reach(console));
  const auto columns = fmt::format("{}", fmt::join(fitted.measured.outputs, ", "));
  const auto name = explored_name(flags.explore, "fit", settings_of(fitted, flags));
  return run_exploration(console, [&](protocol::StopSignals& stop) {
    GrowingStudy study(console, flags.explore, name, fitted.model, stop);
    fitted.problem.evaluate = [&](const std::vector<VectorXd>& points, const std::string& what) {
      return predictions_of(fitted.measured, study.solve(block_of(fitted, points), columns, what));
    };
    try {
      const Fit found = fit(fitted.problem, flags.is_scaled);
      put_out(console, flags.answer, fit_answer(fitted, found, study));
    } catch (const solver::SolveError& error) {
      throw solver::SolveError(
          fmt::format("{}.{}", error.what(), first_failure(study.source(), name)));
    }
    return kDone;
  });
}

int fit_command(const FitFlags& given, Console& console) {
  FitFlags flags = given;
  flags.answer.format = flags.json ? "json" : flags.answer.format;
  check(flags.answer);
  return flags.file.empty() ? fit_to_paper(flags, console) : fit_to_measurements(flags, console);
}

}  // namespace

void add_fit(CLI::App& app, Action& parsed) {
  auto [command, flags] = new_command(
      app, parsed, "fit",
      "Find the parameters with which the model fits measured numbers, and how sure they are",
      kFitExamples, fit_command);
  command
      .add_option("MEASURED.csv", flags.file,
                  "conditions and measured outputs; without it the numbers of the paper are fitted")
      ->type_name("");
  command
      .add_option(
          "--fit", flags.fit,
          "unknown with its bounds; may be given several times. It starts half way, in logarithms "
          "where both bounds are positive")
      ->type_name("KEY=FROM:TO[:START]")
      ->take_all();
  command
      .add_option("--sd", flags.deviation,
                  "standard deviation of the values that have none in the file")
      ->type_name("PERCENT%");
  command.add_flag(
      "--scale", flags.is_scaled,
      "multiply variances by chi2 / degrees of freedom: the deviations are known up to one factor");
  auto* from =
      command
          .add_option("--from", flags.from,
                      "without MEASURED.csv: preset to start from, on the mesh of the paper: " +
                          protocol::joined(solver::preset_names()))
          ->type_name("NAME")
          ->capture_default_str();
  protocol::note_choices(from, solver::preset_names());
  command.add_flag("--json", flags.json, "the same as --format json");
  add_answer_flags(command, flags.answer);
  add_explore_flags(command, flags.explore);
  add_point_flags(command, flags.points, FlagValues::kOne);
  flags.command = &command;
}

}  // namespace oblique::client
