#include "client/convergence/convergence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/row_output.h"
#include "proto/wire/chunk.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using nlohmann::ordered_json;
using solver::readable_number;

constexpr double kMicroseconds = 1e6;
constexpr double kPercent = 100.0;
/// An output counts as settled if its last difference is below this fraction of its scale. On a
/// fine mesh, fast vibrations cause differences of about this size.
constexpr double kSettled = 1e-3;

bool is_settled(const OutputConvergence& output) {
  const auto& extrapolation = output.extrapolation;
  if (extrapolation.trend == Trend::kUnsettled) {
    return *extrapolation.error <= kSettled * output.scale;
  }
  return extrapolation.trend != Trend::kTooFew;
}

/// Name of a trend in JSON, and its remark in the table.
struct TrendNames {
  const char* name;
  const char* remark;
};

TrendNames names_of(const OutputConvergence& output) {
  constexpr std::array<TrendNames, 5> kNames{{{"too few values", "other mode before"},
                                              {"rounding", "rounding only"},
                                              {"monotone", ""},
                                              {"oscillating", "oscillates"},
                                              {"unsettled", "does not settle"}}};
  const auto trend = output.extrapolation.trend;
  const TrendNames names = kNames.at(static_cast<std::size_t>(trend));
  return trend == Trend::kUnsettled && is_settled(output) ? TrendNames{names.name, "wavers"}
                                                          : names;
}

std::optional<double> times(const std::optional<double>& value, double factor) {
  return value ? std::optional(*value * factor) : std::nullopt;
}

// Adds an estimate with two digits.
void add_rough(protocol::Row& row, const std::optional<double>& value) {
  row.emplace_back(value ? readable_number(*value, 2) : std::string("-"));
}

std::optional<double> relative(const OutputConvergence& output) {
  return output.finest() == 0.0
             ? std::nullopt
             : times(output.extrapolation.error, 1.0 / std::abs(output.finest()));
}

void print_outputs(std::ostream& out, const Refinement& refinement) {
  protocol::Table table{.columns = {"output"}};
  for (const auto& level : refinement.levels) {
    table.columns.emplace_back(level.level.name);
  }
  for (const char* column : {"limit", "order", "error", "error [%]", "remark"}) {
    table.columns.emplace_back(column);
  }
  for (const auto& output : refinement.convergence.outputs) {
    auto& row = table.rows.emplace_back();
    const auto shown = shown_column(output.name);
    row.emplace_back(shown.heading);
    for (const auto& value : output.values) {
      row.push_back(value ? protocol::Value(*value * shown.per_unit) : protocol::Value());
    }
    const auto& extrapolation = output.extrapolation;
    row.emplace_back(extrapolation.limit * shown.per_unit);
    add_rough(row, extrapolation.order);
    add_rough(row, times(extrapolation.error, shown.per_unit));
    add_rough(row, times(relative(output), kPercent));
    row.emplace_back(std::string(names_of(output).remark));
  }
  print(out, table, Format::kTable);
}

std::string change_sentence(const Refinement& refinement, const ContactChange& change) {
  const auto& finer = refinement.levels[change.finer_level].level.name;
  const auto& coarser = refinement.levels[change.finer_level - 1].level.name;
  return fmt::format("{} has {}; {} does not", change.in_finer ? finer : coarser, described(change),
                     change.in_finer ? coarser : finer);
}

// The largest relative error and the output that has it.
struct Worst {
  void add(const std::string& name, const std::optional<double>& error) {
    if (error && *error > largest) {
      largest = *error;
      shown = readable_number(kPercent * largest, 2) + " % (" + name + ")";
    }
  }

  double largest = -1.0;
  std::string shown = "-";  // "0.95 % (vt_out_m_s)"
};

void print_verdict(std::ostream& out, const Refinement& refinement) {
  const auto& convergence = refinement.convergence;
  for (const auto& change : convergence.changes) {
    out << "  " << change_sentence(refinement, change) << ".\n";
  }
  const auto& finest = refinement.levels.back().level.name;
  if (converges(refinement)) {
    Worst fine;
    Worst coarse;
    for (const auto& output : convergence.outputs) {
      fine.add(output.name, relative(output));
      coarse.add(output.name, relative_error(output.values.front(), output.extrapolation.limit));
    }
    out << fmt::format("The {} converges; largest estimated error on {}: {}, on {}: {}.\n",
                       refinement.what, finest, fine.shown, refinement.levels.front().level.name,
                       coarse.shown);
    return;
  }
  out << fmt::format("The {} does not converge by {}: ", refinement.what, finest);
  std::vector<std::string> unsettled;
  for (const auto& output : convergence.outputs) {
    if (!is_settled(output)) {
      unsettled.push_back(output.name);
    }
  }
  out << (convergence.has_one_mode ? fmt::format("the mode settles, but these outputs do not: {}",
                                                 fmt::join(unsettled, ", "))
                                   : "the mode differs on the finest three levels");
  // Values of the finest levels differ. Events that only coarser levels lack do not explain that.
  const std::size_t compared = convergence.has_one_mode ? 2 : 3;
  if (!convergence.changes.empty() &&
      convergence.changes.back().finer_level + compared > refinement.levels.size()) {
    out << "; a possible cause: " << change_sentence(refinement, convergence.changes.back());
  } else {
    out << fmt::format("; no event differs between the finest {} levels: refine further with {}",
                       compared, refinement.what == "mesh" ? "--finest" : "--halvings");
  }
  out << ".\n";
}

ordered_json json_of_value(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json json_of(const OutputConvergence& output) {
  ordered_json values = ordered_json::array();
  for (const auto& value : output.values) {
    values.push_back(json_of_value(value));
  }
  const auto& extrapolation = output.extrapolation;
  return {{"name", output.name},
          {"values", values},
          {"finest", output.finest()},
          {"limit", extrapolation.limit},
          {"order", json_of_value(extrapolation.order)},
          {"error", json_of_value(extrapolation.error)},
          {"trend", names_of(output).name}};
}

double fall_tolerance(const Refinement& step) {
  return std::min(step.levels.front().level.model.tolerance, solver::ModelParameters().tolerance);
}

using FallChanges = std::vector<std::pair<std::string, std::optional<double>>>;

// Returns the relative change of each output by the exact fall; nothing if the mode changes.
std::optional<FallChanges> changes_of_fall(const Refinement& step, const SolvedLevel& exact_fall) {
  const auto& exact = exact_fall.result;
  if (step.levels.front().result.major_mode != exact.major_mode) {
    return std::nullopt;
  }
  const auto ours = outputs_of(step.levels.front().result);
  const auto truth = outputs_of(exact);
  FallChanges changes;
  for (std::size_t i = 0; i < truth.size() && i < ours.size(); ++i) {
    changes.emplace_back(truth[i].name, relative_error(ours[i].value, truth[i].value));
  }
  return changes;
}

}  // namespace

Refinement refinement_of(std::string what, std::vector<SolvedLevel> levels) {
  constexpr double kHighOrder = 4.0;  // order of PEFRL and the cubic elements
  constexpr double kLowOrder = 2.0;   // of generalized-alpha
  const bool is_low = what == "step" && levels.front().level.model.integrator ==
                                            solver::Integrator::kGeneralizedAlpha;
  std::vector<solver::CaseResult> results;
  for (const auto& level : levels) {
    results.push_back(level.result);
  }
  auto convergence = convergence_of(results, is_low ? kLowOrder : kHighOrder);
  return {std::move(what), std::move(levels), std::move(convergence)};
}

bool converges(const Refinement& refinement) {
  const auto& convergence = refinement.convergence;
  return convergence.has_one_mode &&
         std::all_of(convergence.outputs.begin(), convergence.outputs.end(), is_settled);
}

void print_refinement(std::ostream& out, const Refinement& refinement) {
  print_outputs(out, refinement);
  out << "\nmode, ripples merged\n";
  for (const auto& [level, result, wall_s] : refinement.levels) {
    out << fmt::format("  {:<8} {}  ({} us steps)\n", level.name, result.major_mode,
                       readable_number(result.solver.dt_s * kMicroseconds, 3));
  }
  print_verdict(out, refinement);
}

std::string fall_sentence(const Refinement& step, const SolvedLevel& exact_fall) {
  const auto changes = changes_of_fall(step, exact_fall);
  const auto solved_for = readable_number(fall_tolerance(step), 2);
  const auto exact = readable_number(exact_fall.level.model.tolerance, 2);
  if (!changes) {
    return fmt::format(
        "The mode depends on the tolerance of the fall: {1} gives another one than {0}.\n",
        solved_for, exact);
  }
  Worst worst;
  for (const auto& [name, change] : *changes) {
    worst.add(name, change);
  }
  return fmt::format("A fall solved for {2} instead of {0} changes outputs by at most {1}.\n",
                     solved_for, worst.shown, exact);
}

ordered_json json_of_fall(const Refinement& step, const SolvedLevel& exact_fall) {
  ordered_json outputs = ordered_json::array();
  const auto changes = changes_of_fall(step, exact_fall);
  for (const auto& [name, change] : changes.value_or(FallChanges{})) {
    outputs.push_back({{"name", name}, {"relative_change", json_of_value(change)}});
  }
  return {{"tolerance", fall_tolerance(step)},
          {"exact_tolerance", exact_fall.level.model.tolerance},
          {"same_mode", changes.has_value()},
          {"outputs", outputs}};
}

ordered_json json_of(const Refinement& refinement) {
  ordered_json levels = ordered_json::array();
  for (const auto& [level, result, wall_s] : refinement.levels) {
    levels.push_back({{"name", level.name},
                      {"elements_per_link", level.model.elements_per_link},
                      {"dt_s", result.solver.dt_s},
                      {"wall_s", wall_s},
                      {"mode", result.mode},
                      {"major_mode", result.major_mode}});
  }
  ordered_json outputs = ordered_json::array();
  for (const auto& output : refinement.convergence.outputs) {
    outputs.push_back(json_of(output));
  }
  ordered_json changes = ordered_json::array();
  for (const auto& change : refinement.convergence.changes) {
    changes.push_back({{"finer", refinement.levels[change.finer_level].level.name},
                       {"coarser", refinement.levels[change.finer_level - 1].level.name},
                       {"kind", name_of(change.kind)},
                       {"t0_s", change.t0_s},
                       {"t1_s", change.t1_s},
                       {"in_finer", change.in_finer}});
  }
  return {{"refined", refinement.what},
          {"converges", converges(refinement)},
          {"levels", levels},
          {"outputs", outputs},
          {"changes", changes}};
}

}  // namespace oblique::client
