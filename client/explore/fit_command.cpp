#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/explore/fit.h"
#include "client/explore/growing_study.h"
#include "client/explore/measurements.h"
#include "client/explore/paper_fit.h"
#include "client/io/progress.h"
#include "client/io/row_output.h"
#include "client/paper/paper_comparison.h"
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

using solver::exact_number;
using solver::fixed_number;
using solver::InputError;
using solver::readable_number;
using solver::signed_number;

constexpr const char* kFitExamples = R"(Examples:
  oblique fit measured.csv --fit k=1e7:1e8 --fit eta2=1:2 --preset paper
  oblique fit measured.csv --fit k=1e7:1e8:2.5e7 --sd 1% --e 1      a start; deviations
  oblique fit measured.csv --fit mu=0.1:1 --sd fn_peak_N=50 --sd duration_s=2% --format json
  oblique fit                             the paper's numbers: A, I, k and eta2
  oblique fit --from paper --elements-per-link 5

measured.csv has a line with the names of its columns and a line for each impact. Columns are H, mu, e
and model keys, outputs as `oblique columns` calls them, and their standard deviations, as
fn_peak_N_sd. What has no column is a flag. Intervals are 95 % profile-likelihood intervals.
Ctrl-C loses nothing: the same command continues.)";

constexpr const char* kMesh = "elements_per_link";
constexpr const char* kUsualFrom = "printed";

struct FitFlags {
  std::string file;
  std::vector<std::string> fit;         ///< "k=1e7:1e8", "k=1e7:1e8:5e7"
  std::vector<std::string> deviations;  ///< of --sd
  bool is_scaled = false;
  PointFlags points;
  ExploreFlags explore;
  OutputFlags output;
  std::string from{kUsualFrom};
  bool json = false;
};

// ---- The paper's numbers ----

const solver::ParameterKey& fitted_key(std::string_view name) {
  return *solver::find_model_key(name);
}

std::string heading(std::string_view name) {
  const auto& key = protocol::axis_key(name);
  return key.unit.empty() ? std::string(name) : fmt::format("{} [{}]", name, key.unit);
}

std::string shown(const PaperFitStep& step) {
  std::string text = fmt::format("iteration {:>2}:", step.iteration);
  for (const auto name : kFittedKeys) {
    text += fmt::format("  {} = {}", name, readable_number(fitted_key(name).get(step.model), 5));
  }
  text += fmt::format("  rms {} %", fixed_number(step.summary.rms_percent, 3));
  if (step.summary.missing > 0) {
    text += fmt::format(" ({} numbers missing)", step.summary.missing);
  }
  return text;
}

double percent_from(double value, double reference) {
  return 100.0 * (value / reference - 1.0);
}

void print_end(std::ostream& out, const PaperFitStep& end, const solver::ModelParameters& start) {
  const solver::ModelParameters preset = solver::preset("paper");
  protocol::Table table{
      .columns = {"parameter", "start", "fitted", "preset paper", "difference [%]"}};
  for (const auto name : kFittedKeys) {
    const auto& key = fitted_key(name);
    const double value = key.get(end.model);
    const double reference = key.get(preset);
    table.rows.push_back({heading(name), key.get(start), value, reference,
                          signed_number(percent_from(value, reference), 2)});
  }
  print(out, table, Format::kTable);
  const auto& summary = end.summary;
  out << fmt::format("\n{} published numbers: rms difference {} %, largest {} %",
                     end.differences.size(), fixed_number(summary.rms_percent, 2),
                     fixed_number(summary.largest_percent, 2));
  if (summary.missing > 0) {
    out << fmt::format(", {} without ours", summary.missing);
  }
  out << fmt::format(" ({} iterations, n = {})\n", end.iteration, end.model.elements_per_link);
}

void print_json(std::ostream& out, const PaperFitStep& end) {
  const solver::ModelParameters preset = solver::preset("paper");
  nlohmann::ordered_json json = {{"elements_per_link", end.model.elements_per_link},
                                 {"iterations", end.iteration},
                                 {"published_numbers", end.differences.size()},
                                 {"missing", end.summary.missing},
                                 {"rms_percent", end.summary.rms_percent},
                                 {"largest_percent", end.summary.largest_percent}};
  for (const auto name : kFittedKeys) {
    const auto& key = fitted_key(name);
    const double value = key.get(end.model);
    json["fitted"][std::string(name)] = value;
    json["from_preset_percent"][std::string(name)] = percent_from(value, key.get(preset));
  }
  out << json.dump(2) << '\n';
}

PaperFitStep fitted(Console& console, const solver::ModelParameters& start) {
  std::atomic<int> iteration{0};
  StatusLine line(console);
  const auto fitting = line.begin([&] {
    return fmt::format("iteration {}, falls on {} elements a link", iteration.load(),
                       start.elements_per_link);
  });
  return fit_paper(published_table(), start, [&](const PaperFitStep& step) {
    line.print(shown(step));
    iteration = step.iteration + 1;
  });
}

int fit_to_paper(const FitFlags& flags, Console& console) {
  auto points = flags.points;
  auto start = solver::preset(flags.from);
  start.elements_per_link = solver::preset("paper").elements_per_link;
  if (const auto mesh = points.axes.extract(kMesh); !mesh.empty()) {
    const auto& key = *solver::find_model_key(kMesh);
    CsvFiles files(".");
    const auto axis = axis_of_flag(key, mesh.mapped(), protocol::BlockKind::kProduct, files);
    const double elements = axis.values_size() == 1 ? axis.values(0) : 0.0;
    solver::check_value(key, elements);
    key.set(start, elements);
  }
  if (points != PointFlags() || !flags.fit.empty() || !flags.deviations.empty()) {
    throw solver::InputError(
        "a fit of measured numbers needs their file: `oblique fit MEASURED.csv --fit ...`; without "
        "one the paper's numbers are fitted, with --from, --elements-per-link and --json alone");
  }
  solver::validate(start);
  const auto end = fitted(console, start);
  if (flags.json || flags.output.format == "json") {
    print_json(console.out(), end);
  } else {
    print_end(console.out(), end, start);
  }
  return kDone;
}

// ---- Measured numbers ----

/// Parses KEY=FROM:TO or KEY=FROM:TO:START.
Unknown unknown_of_flag(const std::string& text) {
  const auto equals = std::min(text.find('='), text.size());
  const auto parts =
      protocol::split(std::string_view(text).substr(std::min(equals + 1, text.size())), ':');
  std::vector<double> numbers;
  for (const auto part : parts) {
    numbers.push_back(solver::number_of(part).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  if (equals == text.size() || parts.size() < 2 || parts.size() > 3 ||
      !std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); })) {
    throw InputError(fmt::format("--fit {}: write KEY=FROM:TO, as k=1e7:1e8, or KEY=FROM:TO:START",
                                 protocol::excerpt(text)));
  }
  try {
    const auto& key = protocol::axis_key(text.substr(0, equals));
    const Unknown unknown{
        std::string(key.name), numbers[0], numbers[1],
        numbers.size() == 3 ? numbers[2] : Unknown::usual_start(numbers[0], numbers[1])};
    solver::check_value(key, unknown.from);
    solver::check_value(key, unknown.to);
    constexpr double kSomewhere = 0.381966;
    if (!key.is_allowed(unknown.from + kSomewhere * (unknown.to - unknown.from))) {
      throw InputError(fmt::format("{} ({}) takes single values only and cannot be fitted",
                                   key.name, key.allowed));
    }
    return unknown;
  } catch (const InputError& error) {
    throw error.at("--fit " + protocol::excerpt(text));
  }
}

/// The fit problem, and how points are made from its unknowns.
struct MeasuredFit {
  Measurements measured;
  std::vector<Unknown> unknowns;
  solver::ModelParameters model;
  std::vector<std::string> keys;                  ///< axes behind those of the unknowns
  std::vector<std::vector<double>> fixed_values;  ///< of these: one a row, or one
};

/// Adds H, mu and e of the flags, and the model. Keys that have a column or are unknowns get a
/// placeholder value in the flags, so that the usual checks of flags apply.
void add_flags(MeasuredFit& fit, PointFlags points, const ReachCheck& check_reach) {
  const auto given = points.axes;
  const auto add = [&](const std::string& key, double value, const char* where) {
    if (given.contains(key)) {
      throw InputError(fmt::format("{} is given twice: as a flag and {}", key, where));
    }
    if (!points.axes.emplace(key, exact_number(value)).second) {
      throw InputError(fmt::format("{} is given twice: as a column or --fit, and {}", key, where));
    }
  };
  for (const auto& [key, values] : fit.measured.conditions) {
    add(key, values.front(), "as a column");
  }
  for (const Unknown& unknown : fit.unknowns) {
    add(unknown.name, unknown.start, "as --fit");
  }
  const auto recipe = recipe_of_flags(points, check_reach);
  fit.model = protocol::from_message(recipe.model());
  for (const auto& axis : recipe.blocks(0).axes()) {
    const std::string& key = axis.key();
    if (axis.values_size() != 1) {
      throw InputError(
          fmt::format("{} {}: fit takes one value; a column of the measurements takes one for "
                      "each line",
                      flag_of_key(key), points.axes[key]));
    }
    if (given.contains(key)) {
      fit.keys.push_back(key);
      fit.fixed_values.push_back({axis.values(0)});
    }
  }
}

MeasuredFit measured_fit(const FitFlags& flags, const ReachCheck& check_reach) {
  if (flags.fit.empty()) {
    throw InputError("nothing is to be fitted: give --fit KEY=FROM:TO, as --fit k=1e7:1e8");
  }
  MeasuredFit fit;
  CsvFiles files(".");
  fit.measured = read_measurements(files.at(flags.file), flags.deviations);
  for (const auto& [key, values] : fit.measured.conditions) {
    fit.keys.push_back(key);
    fit.fixed_values.push_back(values);
  }
  for (const std::string& text : flags.fit) {
    fit.unknowns.push_back(unknown_of_flag(text));
  }
  add_flags(fit, flags.points, check_reach);
  return fit;
}

/// All parameter vectors with all rows of measurements: the rows of the first vector come first.
protocol::Block block_of_points(const MeasuredFit& fit,
                                const std::vector<Eigen::VectorXd>& points) {
  std::vector<std::string> keys;
  std::vector<std::vector<double>> values;
  for (std::size_t i = 0; i < fit.unknowns.size(); ++i) {
    keys.push_back(fit.unknowns[i].name);
    auto& column = values.emplace_back();
    for (const Eigen::VectorXd& point : points) {
      column.insert(column.end(), fit.measured.rows, point[static_cast<Eigen::Index>(i)]);
    }
  }
  for (std::size_t i = 0; i < fit.keys.size(); ++i) {
    keys.push_back(fit.keys[i]);
    auto& column = values.emplace_back();
    for (std::size_t point = 0; point < (fit.fixed_values[i].size() == 1 ? 1 : points.size());
         ++point) {
      column.insert(column.end(), fit.fixed_values[i].begin(), fit.fixed_values[i].end());
    }
  }
  return listed_points(keys, values);
}

double number_or_nan(const protocol::Value& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    return static_cast<double>(*integer);
  }
  const auto* real = std::get_if<double>(&value);
  return real == nullptr ? std::numeric_limits<double>::quiet_NaN() : *real;
}

/// The measured numbers that rows of results have, in the order of the measurements.
std::vector<Eigen::VectorXd> predictions_of(const Measurements& measured,
                                            const protocol::Table& rows) {
  std::vector<Eigen::VectorXd> predictions;
  for (std::size_t first = 0; first < rows.rows.size(); first += measured.rows) {
    auto& prediction = predictions.emplace_back(static_cast<Eigen::Index>(measured.numbers.size()));
    for (std::size_t i = 0; i < measured.numbers.size(); ++i) {
      const auto& number = measured.numbers[i];
      prediction[static_cast<Eigen::Index>(i)] =
          number_or_nan(rows.rows[first + number.row][number.output]);
    }
  }
  return predictions;
}

FitProblem problem_of(const MeasuredFit& fit) {
  FitProblem problem{fit.unknowns, {}, {}, {}, {}};
  const auto& numbers = fit.measured.numbers;
  problem.measured.resize(static_cast<Eigen::Index>(numbers.size()));
  problem.sd.resize(problem.measured.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    problem.measured[static_cast<Eigen::Index>(i)] = numbers[i].value;
    problem.sd[static_cast<Eigen::Index>(i)] = numbers[i].sd;
    problem.names.push_back(numbers[i].name);
  }
  problem.check();
  return problem;
}

/// All that determines the points, for the name of the study.
std::string settings_of(const MeasuredFit& fit, const FitProblem& problem, bool is_scaled) {
  Eigen::VectorXd start(static_cast<Eigen::Index>(fit.unknowns.size()));
  std::string text = protocol::canonical_model(fit.model) + (is_scaled ? " scaled" : "");
  for (std::size_t i = 0; i < fit.unknowns.size(); ++i) {
    start[static_cast<Eigen::Index>(i)] = fit.unknowns[i].start;
    text +=
        fmt::format(" {}:{}", exact_number(fit.unknowns[i].from), exact_number(fit.unknowns[i].to));
  }
  for (std::size_t i = 0; i < problem.names.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    text += fmt::format(" {} {} {}", problem.names[i], exact_number(problem.measured[at]),
                        exact_number(problem.sd[at]));
  }
  return text + block_of_points(fit, {start}).SerializeAsString();
}

// ---- Report ----

/// The printed report of a fit.
struct Report {
  const MeasuredFit& fitted;
  const Fit& fit;
  const GrowingStudy& study;
};

protocol::Value value_or_null(const std::optional<double>& value) {
  return value ? protocol::Value(*value) : protocol::Value();
}

std::string names_of(const Report& report, const std::vector<std::size_t>& numbers) {
  std::vector<std::string_view> names;
  for (const std::size_t number : numbers) {
    names.push_back(report.fitted.unknowns[number].name);
  }
  const auto last = names.back();
  names.pop_back();
  return names.empty() ? std::string(last)
                       : fmt::format("{} and {}", protocol::joined(names), last);
}

/// Sentences about what the data do not determine.
std::vector<std::string> notes_of(const Report& report) {
  std::vector<std::string> notes;
  const Fit& fit = report.fit;
  for (const std::size_t number : fit.without_effect) {
    notes.push_back(fmt::format("{} has no effect on these data.", names_of(report, {number})));
  }
  for (const auto& set : fit.inseparable) {
    notes.push_back(
        set.size() == 1
            ? names_of(report, set) + " is not determined by these data."
            : names_of(report, set) +
                  " cannot be told apart by these data: only a combination of them is determined.");
  }
  for (const auto& [a, b] : fit.correlated) {
    notes.push_back(fmt::format(
        "{} can hardly be told apart by these data: their correlation is {}.",
        names_of(report, {a, b}),
        fixed_number(fit.correlation(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)),
                     4)));
  }
  for (std::size_t i = 0; i < fit.estimates.size(); ++i) {
    const auto& unknown = report.fitted.unknowns[i];
    const auto& estimate = fit.estimates[i];
    if (estimate.is_at_bound) {
      const bool is_lower = estimate.value - unknown.from < unknown.to - estimate.value;
      notes.push_back(fmt::format("{} is at its {} bound, {}: wider bounds may fit better.",
                                  unknown.name, is_lower ? "lower" : "upper",
                                  exact_number(is_lower ? unknown.from : unknown.to)));
    } else if (!estimate.lower || !estimate.upper) {
      notes.push_back(fmt::format("The data give {} no {} end: its interval goes on to the bound.",
                                  unknown.name,
                                  estimate.lower   ? "upper"
                                  : estimate.upper ? "lower"
                                                   : "lower and no upper"));
    }
  }
  const auto degrees = static_cast<double>(fit.degrees_of_freedom);
  if (degrees > 0.0 && fit.minimum.chi2 > degrees + 4.0 * std::sqrt(2.0 * degrees)) {
    notes.push_back(
        "chi2 is larger than the deviations explain: they are too small, or the model lacks "
        "something. "
        "--scale widens the intervals accordingly.");
  }
  return notes;
}

protocol::Table table_of_unknowns(const Report& report) {
  protocol::Table table{
      .columns = {"unknown", "unit", "from", "to", "start", "value", "sd", "lower_95", "upper_95"}};
  for (std::size_t i = 0; i < report.fit.estimates.size(); ++i) {
    const Unknown& unknown = report.fitted.unknowns[i];
    const auto& estimate = report.fit.estimates[i];
    table.rows.push_back({unknown.name, std::string(protocol::axis_key(unknown.name).unit),
                          unknown.from, unknown.to, unknown.start, estimate.value,
                          value_or_null(estimate.sd), value_or_null(estimate.lower),
                          value_or_null(estimate.upper)});
  }
  return table;
}

/// The same for reading: the unit in the name, without bounds.
protocol::Table shown_table_of_unknowns(const Report& report) {
  protocol::Table table = table_of_unknowns(report);
  table.columns.erase(table.columns.begin() + 1, table.columns.begin() + 4);
  for (auto& row : table.rows) {
    row.front() = heading(std::get<std::string>(row.front()));
    row.erase(row.begin() + 1, row.begin() + 4);
  }
  return table;
}

protocol::Table table_of_correlations(const Report& report) {
  protocol::Table table{.columns = {"correlation"}};
  for (std::size_t i = 0; i < report.fitted.unknowns.size(); ++i) {
    table.columns.push_back(report.fitted.unknowns[i].name);
    auto& row = table.rows.emplace_back();
    row.emplace_back(report.fitted.unknowns[i].name);
    for (std::size_t j = 0; j < report.fitted.unknowns.size(); ++j) {
      row.emplace_back(fixed_number(
          report.fit.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)), 3));
    }
  }
  return table;
}

protocol::Table table_of_residuals(const Report& report) {
  protocol::Table table{.columns = {"row", "output", "measured", "sd", "fitted", "residual_sd"}};
  const auto& numbers = report.fitted.measured.numbers;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const double fitted = report.fit.minimum.predictions[static_cast<Eigen::Index>(i)];
    table.rows.push_back({static_cast<std::int64_t>(numbers[i].row + 1),
                          report.fitted.measured.outputs[numbers[i].output], numbers[i].value,
                          numbers[i].sd, fitted, (fitted - numbers[i].value) / numbers[i].sd});
  }
  return table;
}

void print_report(std::ostream& out, const Report& report) {
  const Fit& fit = report.fit;
  print(out, shown_table_of_unknowns(report), Format::kTable);
  out << fmt::format("\nchi2 = {} with {}", readable_number(fit.minimum.chi2, 4),
                     counted(fit.degrees_of_freedom, "degree of freedom", "degrees of freedom"));
  if (fit.degrees_of_freedom > 0) {
    out << fmt::format(
        ", {} each{}",
        readable_number(fit.minimum.chi2 / static_cast<double>(fit.degrees_of_freedom), 3),
        fit.scale == 1.0 ? "" : ", by which variances and intervals are scaled");
  }
  out << '\n';
  for (const std::string& note : notes_of(report)) {
    out << note << '\n';
  }
  if (report.fitted.unknowns.size() > 1) {
    out << '\n';
    print(out, table_of_correlations(report), Format::kTable);
  }
  out << '\n';
  print(out, table_of_residuals(report), Format::kTable);
}

nlohmann::ordered_json json_of(const protocol::Table& table) {
  std::ostringstream text;
  print(text, table, Format::kJson);
  return nlohmann::ordered_json::parse(text.str());
}

nlohmann::ordered_json json_of(const Report& report) {
  const Fit& fit = report.fit;
  nlohmann::ordered_json json{{"study", report.study.name()},
                              {"iterations", fit.minimum.iteration},
                              {"rounds", report.study.rounds()},
                              {"points", report.study.points()},
                              {"chi2", fit.minimum.chi2},
                              {"degrees_of_freedom", fit.degrees_of_freedom},
                              {"scale", fit.scale},
                              {"unknowns", json_of(table_of_unknowns(report))}};
  for (const auto& row : fit.correlation.rowwise()) {
    json["correlation"].push_back(std::vector<double>(row.begin(), row.end()));
  }
  json["notes"] = notes_of(report);
  json["residuals"] = json_of(table_of_residuals(report));
  return json;
}

void write_report(const FitFlags& flags, const Report& report, Format format) {
  std::ostringstream text;
  if (format == Format::kTable) {
    print_report(text, report);
  } else if (format == Format::kCsv) {
    print(text, table_of_unknowns(report), format);
  } else {
    text << json_of(report).dump(2) << '\n';
  }
  std::unique_ptr<Sink> sink;
  if (flags.output.file.empty()) {
    sink = std::make_unique<StandardOutput>(!flags.output.no_pager && format == Format::kTable);
  } else {
    sink = std::make_unique<AtomicFile>(flags.output.file);
  }
  sink->append(text.str());
  sink->finish();
}

int fit_to_measurements(const FitFlags& flags, Console& console) {
  constexpr std::array<std::string_view, 3> kFormats{"table", "csv", "json"};
  const auto format =
      format_of_output(flags.json ? "json" : flags.output.format, flags.output.file, kFormats);
  if (flags.from != kUsualFrom) {
    throw InputError(
        "--from is allowed only in a fit to the paper's numbers: use --preset to choose the model");
  }
  const auto fitted = measured_fit(flags, tip_reach(console));
  auto problem = problem_of(fitted);
  const auto name =
      explored_name(flags.explore, "fit", settings_of(fitted, problem, flags.is_scaled));
  return run_exploration(console, [&](protocol::StopSignals& stop) {
    GrowingStudy study(console, flags.explore, name, fitted.model, stop);
    const std::string columns = fmt::format("{}", fmt::join(fitted.measured.outputs, ", "));
    problem.evaluate = [&](const std::vector<Eigen::VectorXd>& points, const std::string& what) {
      return predictions_of(fitted.measured,
                            study.solve(block_of_points(fitted, points), columns, what));
    };
    const Fit found = fit(problem, flags.is_scaled);
    write_report(flags, {fitted, found, study}, format);
    return kDone;
  });
}

int fit_command(const FitFlags& flags, Console& console) {
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
      .add_option("--sd", flags.deviations,
                  "standard deviations that the file lacks: of all outputs, relative, or of one")
      ->type_name("1%|OUTPUT=VALUE|OUTPUT=1%")
      ->take_all();
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
  add_output_flags(command, flags.output);
  add_explore_flags(command, flags.explore);
  add_point_flags(command, flags.points, FlagValues::kOne);
}

}  // namespace oblique::client
