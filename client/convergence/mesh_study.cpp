#include "client/convergence/mesh_study.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <spdlog/fmt/fmt.h>

#include "client/output/columns.h"
#include "client/output/printer.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using nlohmann::ordered_json;
using solver::exact_number;
using solver::readable_number;

constexpr double kHundred = 100.0;

// Under which output one is counted; nothing for the largest F_n, which is one of the peaks.
std::optional<std::string> counted_under(const std::string& name) {
  if (name == "fn_peak_N") {
    return std::nullopt;
  }
  if (name.starts_with("major_peak")) {
    return "major_peaks_N";
  }
  return name.starts_with("reaction") ? "reaction_peaks_N" : name;
}

// Errors of one output of a point, a level each.
struct PointErrors {
  std::string name;
  double limit;
  std::vector<std::optional<double>> errors;
};

PointErrors errors_of(const OutputConvergence& output, const std::string& name) {
  PointErrors point{name, output.extrapolation.limit, {}};
  for (const auto& value : output.values) {
    point.errors.push_back(relative_error(value, point.limit));
  }
  return point;
}

// Keeps the worse of two on each level; another mode is the worst.
void take_worse(PointErrors& kept, const PointErrors& other) {
  for (std::size_t level = 0; level < kept.errors.size(); ++level) {
    auto& error = kept.errors[level];
    if (error && (!other.errors[level] || *other.errors[level] > *error)) {
      error = other.errors[level];
      kept.limit = other.limit;
    }
  }
}

std::vector<PointErrors> errors_at(const Refinement& point) {
  std::vector<PointErrors> all;
  for (const auto& output : point.convergence.outputs) {
    const auto name = counted_under(output.name);
    if (!name || output.extrapolation.limit == 0.0) {
      continue;
    }
    const auto errors = errors_of(output, *name);
    const auto known = std::find_if(all.begin(), all.end(),
                                    [&](const PointErrors& each) { return each.name == *name; });
    if (known == all.end()) {
      all.push_back(errors);
    } else {
      take_worse(*known, errors);
    }
  }
  return all;
}

using Errors = std::vector<std::vector<std::optional<double>>>;

OutputStudy& study_named(std::vector<OutputStudy>& outputs, const std::string& name,
                         std::size_t levels) {
  const auto known = std::find_if(outputs.begin(), outputs.end(),
                                  [&](const OutputStudy& each) { return each.name == name; });
  return known == outputs.end() ? outputs.emplace_back(OutputStudy{name, Errors(levels)}) : *known;
}

bool is_within(const std::optional<double>& error, double tolerance) {
  return error && *error <= tolerance;
}

std::vector<double> known_errors(const OutputStudy& output, std::size_t level) {
  std::vector<double> known;
  for (const auto& error : output.errors[level]) {
    if (error) {
      known.push_back(*error);
    }
  }
  std::sort(known.begin(), known.end());
  return known;
}

std::optional<std::size_t> coarsest_good_enough(const MeshStudy& study) {
  std::optional<std::size_t> chosen;
  const auto is_good_enough = [&](std::size_t level) {
    return std::all_of(study.outputs.begin(), study.outputs.end(), [&](const OutputStudy& output) {
      return static_cast<double>(output.within(level, study.tolerance)) >=
             MeshStudy::kMostPoints * static_cast<double>(output.points());
    });
  };
  for (std::size_t level = study.levels.size(); level-- > 0 && is_good_enough(level);) {
    chosen = level;
  }
  return chosen;
}

void print_cells(std::ostream& out, const MeshStudy& study,
                 const std::function<std::string(const OutputStudy&, std::size_t)>& cell) {
  protocol::Table table;
  table.columns.emplace_back("output");
  for (const auto& level : study.levels) {
    table.columns.emplace_back(level);
  }
  for (const auto& output : study.outputs) {
    auto& row = table.rows.emplace_back();
    add_value(row, output.name);
    for (std::size_t level = 0; level < study.levels.size(); ++level) {
      add_value(row, cell(output, level));
    }
  }
  print(out, table, Format::kTable);
}

std::string percent(const std::optional<double>& error) {
  return error ? solver::fixed_number(kHundred * *error, 2) : std::string("-");
}

void print_misses(std::ostream& out, const MeshStudy& study,
                  const std::vector<ContactPoint>& points) {
  for (const auto& miss : study.misses[*study.chosen]) {
    const auto& point = points[miss.point];
    const auto shown = shown_column(miss.output);
    out << fmt::format("  H = {} m, mu = {}, e* = {}: {} of {} {}\n", exact_number(point.H_m),
                       exact_number(point.mu), exact_number(point.e_star),
                       miss.error ? readable_number(kHundred * *miss.error, 2) + " %"
                                  : std::string("another mode instead"),
                       readable_number(miss.limit * shown.per_unit, 3), shown.heading);
  }
}

}  // namespace

std::optional<double> OutputStudy::largest(std::size_t level) const {
  const auto known = known_errors(*this, level);
  return known.empty() ? std::nullopt : std::optional(known.back());
}

std::optional<double> OutputStudy::median(std::size_t level) const {
  const auto known = known_errors(*this, level);
  return known.empty() ? std::nullopt : std::optional(known[known.size() / 2]);
}

std::size_t OutputStudy::within(std::size_t level, double tolerance) const {
  return static_cast<std::size_t>(
      std::count_if(errors[level].begin(), errors[level].end(),
                    [&](const auto& error) { return is_within(error, tolerance); }));
}

MeshStudy study_of(const std::vector<Refinement>& points, double tolerance) {
  MeshStudy study{.levels = {},
                  .points = points.size(),
                  .tolerance = tolerance,
                  .outputs = {},
                  .misses = {},
                  .chosen = {}};
  for (const auto& level : points.front().levels) {
    study.levels.push_back(level.level.name);
  }
  study.misses.resize(study.levels.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const auto& output : errors_at(points[i])) {
      auto& all = study_named(study.outputs, output.name, study.levels.size());
      for (std::size_t level = 0; level < study.levels.size(); ++level) {
        const auto& error = output.errors[level];
        all.errors[level].push_back(error);
        if (!is_within(error, tolerance)) {
          study.misses[level].push_back({i, output.name, error, output.limit});
        }
      }
    }
  }
  study.chosen = coarsest_good_enough(study);
  return study;
}

void print_study(std::ostream& out, const MeshStudy& study,
                 const std::vector<ContactPoint>& points) {
  const std::string tolerance = exact_number(kHundred * study.tolerance);
  out << fmt::format("{} points: difference from the limit, largest / median [%]\n\n",
                     study.points);
  print_cells(out, study, [](const OutputStudy& output, std::size_t level) {
    return fmt::format("{:>6} / {:>5}", percent(output.largest(level)),
                       percent(output.median(level)));
  });
  out << fmt::format("\nat how many points it is within {} %, and the mode is that of {}\n\n",
                     tolerance, study.levels.back());
  print_cells(out, study, [&](const OutputStudy& output, std::size_t level) {
    return fmt::format("{:>2} of {}", output.within(level, study.tolerance), output.points());
  });
  if (!study.chosen) {
    out << fmt::format("\nNo mesh has every output within {} % at {} % of the points.\n", tolerance,
                       exact_number(kHundred * MeshStudy::kMostPoints));
    return;
  }
  out << fmt::format(
      "\nThe coarsest mesh with every output within {} % at {} % of the points: {}.\n", tolerance,
      exact_number(kHundred * MeshStudy::kMostPoints), study.levels[*study.chosen]);
  if (!study.misses[*study.chosen].empty()) {
    out << "Not within it there:\n";
    print_misses(out, study, points);
  }
}

ordered_json json_of(const MeshStudy& study) {
  ordered_json outputs = ordered_json::array();
  const auto json_of_error = [](const std::optional<double>& error) {
    return error ? ordered_json(*error) : ordered_json();
  };
  for (const auto& output : study.outputs) {
    ordered_json levels = ordered_json::array();
    for (std::size_t level = 0; level < study.levels.size(); ++level) {
      levels.push_back({{"name", study.levels[level]},
                        {"largest", json_of_error(output.largest(level))},
                        {"median", json_of_error(output.median(level))},
                        {"within", output.within(level, study.tolerance)}});
    }
    outputs.push_back({{"name", output.name}, {"points", output.points()}, {"levels", levels}});
  }
  return {{"within_percent", kHundred * study.tolerance},
          {"chosen", study.chosen ? ordered_json(study.levels[*study.chosen]) : ordered_json()},
          {"outputs", outputs}};
}

}  // namespace oblique::client
