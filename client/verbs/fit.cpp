#include <atomic>
#include <cmath>
#include <iostream>
#include <memory>
#include <string>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/output/printer.h"
#include "client/output/work_line.h"
#include "client/paper/parameter_fit.h"
#include "client/verbs/verbs.h"
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
  oblique fit --elements-per-link 5       the same on another mesh, which fits far worse
  oblique fit --json > fit.json

Three falls an iteration, those of A and I side by side: some seconds in all.)";

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

void print_end(const FitStep& end, const solver::ModelParameters& start) {
  const solver::ModelParameters preset = solver::preset("paper");
  protocol::Table table{
      .columns = {"parameter", "start", "fitted", "preset paper", "difference [%]"}};
  for (const auto name : kFittedKeys) {
    const auto& key = fitted_key(name);
    auto& row = table.rows.emplace_back();
    add_value(row, heading(name));
    add_value(row, key.get(start));
    add_value(row, key.get(end.model));
    add_value(row, key.get(preset));
    add_value(row, signed_number(percent_from(key.get(end.model), key.get(preset)), 2));
  }
  print(std::cout, table, Format::kTable);
  const auto& summary = end.summary;
  std::cout << fmt::format("\n{} published numbers: rms difference {} %, largest {} %",
                           end.differences.size(), fixed_number(summary.rms_percent, 2),
                           fixed_number(summary.largest_percent, 2));
  if (summary.missing > 0) {
    std::cout << fmt::format(", {} without ours", summary.missing);
  }
  std::cout << fmt::format(" ({} iterations, n = {})\n", end.iteration,
                           end.model.elements_per_link);
}

void print_json(const FitStep& end) {
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
  std::cout << json.dump(2) << '\n';
}

FitStep fitted(const solver::ModelParameters& start) {
  std::atomic<int> iteration{0};
  WorkLine line;
  const auto fitting = line.begin([&] {
    return fmt::format("iteration {}, falls on {} elements a link", iteration.load(),
                       start.elements_per_link);
  });
  return fit_parameters(published_table(), start, [&](const FitStep& step) {
    line.tell(shown(step));
    iteration = step.iteration + 1;
  });
}

int fit(const FitFlags& flags) {
  auto start = solver::preset(flags.from);
  start.elements_per_link = flags.elements_per_link;
  solver::validate(start);
  const auto end = fitted(start);
  if (flags.json) {
    print_json(end);
  } else {
    print_end(end, start);
  }
  return kDone;
}

}  // namespace

void add_fit(CLI::App& app, Command& command) {
  auto flags = std::make_shared<FitFlags>();
  auto* verb = app.add_subcommand(
      "fit", "Recover the parameters that the paper does not print from the numbers it does");
  verb->footer(kFitExamples);
  auto* from = verb->add_option("--from", flags->from,
                                "preset to start from: " + protocol::joined(solver::preset_names()))
                   ->type_name("NAME")
                   ->capture_default_str();
  protocol::note_choices(from, solver::preset_names());
  verb->add_option("--elements-per-link", flags->elements_per_link, "mesh on which to fit")
      ->type_name("N")
      ->capture_default_str();
  verb->add_flag("--json", flags->json, "print the end as one JSON object");
  verb->callback([flags, &command] { command = [flags] { return fit(*flags); }; });
}

}  // namespace oblique::client
