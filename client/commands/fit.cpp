#include <atomic>
#include <ostream>
#include <string>
#include <string_view>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/io/progress.h"
#include "client/io/row_output.h"
#include "client/paper/paper_comparison.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

using solver::fixed_number;
using solver::readable_number;
using solver::signed_number;
constexpr const char* kFitExamples = R"(Examples:
  oblique fit
  oblique fit --from paper
  oblique fit --elements-per-link 5       on another mesh, which fits far worse
  oblique fit --json > fit.json

Each iteration solves three falls, those for A and I side by side. Takes some seconds.)";

struct FitFlags {
  std::string from{"printed"};
  int elements_per_link = solver::preset("paper").elements_per_link;
  bool json = false;
};

const solver::ParameterKey& fitted_key(std::string_view name) {
  return *solver::find_model_key(name);
}

std::string heading(std::string_view name) {
  const auto& key = fitted_key(name);
  return key.unit.empty() ? std::string(name) : fmt::format("{} [{}]", name, key.unit);
}

std::string shown(const FitStep& step) {
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

void print_end(std::ostream& out, const FitStep& end, const solver::ModelParameters& start) {
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

void print_json(std::ostream& out, const FitStep& end) {
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

FitStep fitted(Console& console, const solver::ModelParameters& start) {
  std::atomic<int> iteration{0};
  StatusLine line(console);
  const auto fitting = line.begin([&] {
    return fmt::format("iteration {}: solving falls on {} elements a link", iteration.load(),
                       start.elements_per_link);
  });
  return fit_parameters(published_table(), start, [&](const FitStep& step) {
    line.print(shown(step));
    iteration = step.iteration + 1;
  });
}

int fit(const FitFlags& flags, Console& console) {
  auto start = solver::preset(flags.from);
  start.elements_per_link = flags.elements_per_link;
  solver::validate(start);
  const auto end = fitted(console, start);
  if (flags.json) {
    print_json(console.out(), end);
  } else {
    print_end(console.out(), end, start);
  }
  return kDone;
}

}  // namespace

void add_fit(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "fit",
                  "Fit the parameters that the paper does not print to the numbers it prints",
                  kFitExamples, fit);
  auto* from = command
                   .add_option("--from", flags.from,
                               "preset to start from: " + protocol::joined(solver::preset_names()))
                   ->type_name("NAME")
                   ->capture_default_str();
  protocol::note_choices(from, solver::preset_names());
  command.add_option("--elements-per-link", flags.elements_per_link, "mesh on which to fit")
      ->type_name("N")
      ->capture_default_str();
  command.add_flag("--json", flags.json, "print the result as one JSON object");
}

}  // namespace oblique::client
