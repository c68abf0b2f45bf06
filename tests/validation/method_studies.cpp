// Computes the two studies in worker/solver/accuracy.md: which mesh is fine enough, and the errors
// of the chosen steps.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <future>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/convergence/convergence.h"
#include "client/io/row_output.h"
#include "worker/solver/falls.h"
#include "worker/solver/model/number.h"
#include "worker/solver/solve.h"
#include "worker/solver/step_choice.h"

namespace oblique::client {
namespace {

using solver::CaseResult;
using solver::exact_number;
using solver::fixed_number;
using Fallen = std::shared_ptr<const solver::FallenChain>;

constexpr const char* kHelp =
    "Usage: oblique-method-studies mesh|steps\n"
    "  mesh    how far meshes of 6 to 96 elements a link are from the limits at 30 points, and "
    "the\n"
    "          coarsest that is good enough: the mesh of the preset `converged` (some minutes)\n"
    "  steps   errors of the chosen steps against steps six times shorter, over models around the\n"
    "          preset `paper` (half a minute)\n";

Fallen fall_of(const solver::ModelParameters& model) {
  auto fall = solver::solve_falls({&model, 1}).front();
  if (!fall.fallen) {
    throw solver::SolveError(fall.error);
  }
  return fall.fallen;
}

/// Returns the results of `points` in the order of the points. Throws SolveError if a point fails.
std::vector<CaseResult> contacts_of(const solver::Finger& finger,
                                    const std::vector<ContactPoint>& points) {
  std::vector<solver::Point> solver_points;
  for (const ContactPoint& point : points) {
    solver_points.push_back({point.H_m, point.mu, point.e_star});
  }
  std::vector<CaseResult> results;
  for (solver::Outcome& outcome : solver::solve_points(finger, solver_points)) {
    if (!outcome.result) {
      throw solver::SolveError(outcome.error);
    }
    results.push_back(std::move(*outcome.result));
  }
  return results;
}

// ---- Meshes ----

constexpr double kTolerance = 0.005;  // relative
// A mesh is fine enough if each output is within the tolerance at this fraction of the points. The
// fraction is below 1 because exit velocities pass through zero, where relative errors are large.
constexpr double kMaxPoints = 0.8;

/// Errors of one output at one point, one per level of the mesh, relative to the extrapolated value
/// `limit`. A level has no error if its mode differs from the mode of the finest level.
struct PointErrors {
  std::size_t point;
  double limit;
  std::vector<std::optional<double>> errors;
};

/// Errors of one output at all points.
struct OutputStudy {
  std::string name;
  std::vector<PointErrors> points;
};

bool is_within(const std::optional<double>& error) {
  return error && *error <= kTolerance;
}

std::size_t points_within(const OutputStudy& output, std::size_t level) {
  return static_cast<std::size_t>(
      std::count_if(output.points.begin(), output.points.end(),
                    [&](const PointErrors& point) { return is_within(point.errors[level]); }));
}

/// Returns the name under which the errors of an output are collected. All major peaks of F_n,
/// which include fn_peak_N, have one name, and so have all reactions. The largest error counts.
std::string counted_under(const std::string& name) {
  return name.starts_with("major_peak") ? "major_peaks_N"
         : name.starts_with("reaction") ? "reaction_peaks_N"
                                        : name;
}

void add_point(std::vector<OutputStudy>& outputs, std::size_t point,
               const PointConvergence& convergence) {
  for (const auto& output : convergence.outputs) {
    const double limit = output.extrapolation.limit;
    if (output.name == "fn_peak_N" ||
        limit == 0.0) {  // such as stick_total_s of a contact without stick
      continue;
    }
    std::vector<std::optional<double>> errors;
    for (const auto& value : output.values) {
      errors.push_back(relative_error(value, limit));
    }
    const std::string name = counted_under(output.name);
    auto study = std::find_if(outputs.begin(), outputs.end(),
                              [&](const OutputStudy& each) { return each.name == name; });
    if (study == outputs.end()) {
      study = outputs.insert(study, {name, {}});
    }
    if (study->points.empty() || study->points.back().point != point) {
      study->points.push_back({point, limit, errors});
      continue;
    }
    auto& worst = study->points.back();
    for (std::size_t level = 0; level < errors.size(); ++level) {
      auto& error = worst.errors[level];
      if (error && (!errors[level] || *errors[level] > *error)) {
        error = errors[level];
        worst.limit = limit;
      }
    }
  }
}

std::string largest_and_median(const OutputStudy& output, std::size_t level) {
  std::vector<double> known;
  for (const auto& point : output.points) {
    if (point.errors[level]) {
      known.push_back(100.0 * *point.errors[level]);
    }
  }
  std::sort(known.begin(), known.end());
  return fmt::format("{:>6} / {:>5}", known.empty() ? "-" : fixed_number(known.back(), 2),
                     known.empty() ? "-" : fixed_number(known[known.size() / 2], 2));
}

void print_cells(const std::vector<Level>& levels, const std::vector<OutputStudy>& outputs,
                 const std::function<std::string(const OutputStudy&, std::size_t)>& cell) {
  protocol::Table table;
  table.columns.emplace_back("output");
  for (const auto& level : levels) {
    table.columns.emplace_back(level.name);
  }
  for (const auto& output : outputs) {
    auto& row = table.rows.emplace_back();
    row.emplace_back(output.name);
    for (std::size_t level = 0; level < levels.size(); ++level) {
      row.emplace_back(cell(output, level));
    }
  }
  print(std::cout, table, Format::kTable);
}

/// Returns the coarsest level from which on all levels are fine enough, or the number of levels if
/// there is none.
std::size_t coarsest_good_enough(std::size_t levels, const std::vector<OutputStudy>& outputs) {
  const auto is_good_enough = [&](std::size_t level) {
    return std::all_of(outputs.begin(), outputs.end(), [&](const OutputStudy& output) {
      return static_cast<double>(points_within(output, level)) >=
             kMaxPoints * static_cast<double>(output.points.size());
    });
  };
  std::size_t chosen = levels;
  while (chosen > 0 && is_good_enough(chosen - 1)) {
    --chosen;
  }
  return chosen;
}

void print_misses(const std::vector<OutputStudy>& outputs, std::size_t level,
                  const std::vector<ContactPoint>& points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const auto& output : outputs) {
      for (const auto& [point, limit, errors] : output.points) {
        if (point == i && !is_within(errors[level])) {
          const auto shown = shown_column(output.name);
          std::cout << fmt::format(
              "  H = {} m, mu = {}, e* = {}: {} of {} {}\n", exact_number(points[i].H_m),
              exact_number(points[i].mu), exact_number(points[i].e_star),
              errors[level] ? solver::readable_number(100.0 * *errors[level], 2) + " %"
                            : std::string("another mode instead"),
              solver::readable_number(limit * shown.per_unit, 3), shown.heading);
        }
      }
    }
  }
}

void study_meshes() {
  constexpr int kCoarsest = 6;
  constexpr int kFinest = 96;
  constexpr double kHighestOrder = 4.0;
  std::vector<ContactPoint> points;
  for (const double H_m : {0.4, 0.7, 1.0}) {
    for (const double mu : {0.1, 0.4, 0.8, 1.2, 1.6}) {
      for (const double e_star : {1.0, 0.6}) {
        points.push_back({H_m, mu, e_star});
      }
    }
  }
  const auto levels = mesh_levels(solver::ModelParameters(), kCoarsest, kFinest);
  std::vector<std::future<std::vector<CaseResult>>> solving;
  for (const auto& level : levels) {
    solving.push_back(std::async(std::launch::async, [&] {
      return contacts_of(solver::Finger(level.model, fall_of(level.model)), points);
    }));
  }
  std::vector<std::vector<CaseResult>> of_points(points.size());
  for (auto& level : solving) {
    auto results = level.get();
    for (std::size_t i = 0; i < points.size(); ++i) {
      of_points[i].push_back(std::move(results[i]));
    }
  }
  std::vector<OutputStudy> outputs;
  for (std::size_t i = 0; i < points.size(); ++i) {
    add_point(outputs, i, convergence_of(of_points[i], kHighestOrder));
  }
  std::cout << points.size() << " points: difference from the limit, largest / median [%]\n\n";
  print_cells(levels, outputs, largest_and_median);
  std::cout << "\nat how many points it is within 0.5 %, and the mode is that of "
            << levels.back().name << "\n\n";
  print_cells(levels, outputs, [](const OutputStudy& output, std::size_t level) {
    return fmt::format("{:>2} of {}", points_within(output, level), output.points.size());
  });
  const std::size_t chosen = coarsest_good_enough(levels.size(), outputs);
  if (chosen == levels.size()) {
    std::cout << "\nNo mesh has every output within 0.5 % at 80 % of the points.\n";
    return;
  }
  std::cout << "\nThe coarsest mesh with every output within 0.5 % at 80 % of the points: "
            << levels[chosen].name << ".\nNot within it there:\n";
  print_misses(outputs, chosen, points);
}

// ---- Steps ----

/// A model, and the points and steps at which its errors are measured.
struct StepCase {
  std::string name;  ///< for example "k = 1e+08"
  solver::ModelParameters model;
  std::size_t points = 300;
  double least_e =
      solver::StepChoice::kFastRestitution;  ///< smallest e*; a smaller e* needs shorter steps
  double largest_e = 1.0;
  std::vector<double> factors{1.0};  ///< factors that multiply the chosen steps
};

/// Largest errors over all points of one mode.
struct StepErrors {
  double step_s = 0.0;     ///< in compression
  double of_limit = 0.0;   ///< step in compression, divided by the longest stable step
  double peaks = 0.0;      ///< error of major peaks of F_n, relative to the largest peak
  double each_peak = 0.0;  ///< error of major peaks of F_n, relative to each peak
  double duration = 0.0;   ///< relative
  double slide = 0.0;      ///< relative
  double stick_s = 0.0;
  double exit_m_s = 0.0;         ///< larger of the errors of both components of the exit velocity
  std::int64_t late_sticks = 0;  ///< number of points whose stick has an error above 5 ns
  std::int64_t grazing = 0;      ///< number of points left out: their mode depends on the step
};

/// Returns variations of the preset `paper`: mesh, contact stiffness, e*, tip mass and lengths.
std::vector<StepCase> step_cases() {
  const auto model = solver::preset("paper");
  std::vector<StepCase> cases;
  for (const auto& [n, points] : {std::pair{4, 1500U}, {8, 800U}, {16, 300U}, {32, 60U}}) {
    auto& mesh = cases.emplace_back(StepCase{fmt::format("n = {}", n), model, points});
    mesh.model.elements_per_link = n;
    mesh.factors = {0.5, 1.0, 2.0};
  }
  const std::pair<const char*, std::vector<double>> keys[]{
      {"k", {1e6, 1e7, 1e8, 1e9}}, {"eta2", {0.2, 5.0}},   {"tip_mass", {0.01, 0.1}},
      {"E", {7e8, 7e11}},          {"length", {0.1, 1.0}},
  };
  for (const auto& [key, values] : keys) {
    for (const double value : values) {
      auto& varied =
          cases.emplace_back(StepCase{fmt::format("{} = {}", key, exact_number(value)), model});
      solver::find_model_key(key)->set(varied.model, value);
    }
  }
  cases.emplace_back(StepCase{"lengths = 0.6,0.4,0.2", model}).model.lengths_m = {0.6, 0.4, 0.2};
  cases.emplace_back(StepCase{"lengths = 0.2,0.4,0.6", model}).model.lengths_m = {0.2, 0.4, 0.6};
  for (const auto& [least, largest] : {std::pair{0.2, 0.4}, {0.05, 0.2}, {0.001, 0.05}}) {
    cases.push_back({fmt::format("e* from {} to {}", exact_number(least), exact_number(largest)),
                     model, 300, least, largest});
  }
  return cases;
}

/// Returns points that are spread evenly in H, mu and e*, the same in every run. They follow an
/// additive recurrence with the first three powers of 1/x, where x = 1.2207 is the root of x^4 = x
/// + 1.
std::vector<ContactPoint> step_points(const StepCase& of, double largest_drop_m) {
  constexpr double kRoot = 1.2207440846057596;
  const auto between = [](double least, double largest, std::size_t i, double step) {
    const double sum = 0.5 + step * static_cast<double>(i + 1);
    return least + (largest - least) * (sum - std::floor(sum));
  };
  std::vector<ContactPoint> points;
  for (std::size_t i = 0; i < of.points; ++i) {
    points.push_back({between(0.17, 0.97, i, 1.0 / kRoot) * largest_drop_m,
                      between(0.0, 2.0, i, std::pow(kRoot, -2.0)),
                      between(of.least_e, of.largest_e, i, std::pow(kRoot, -3.0))});
  }
  return points;
}

void judge(const CaseResult& result, const CaseResult& reference, StepErrors& errors) {
  constexpr double kLateStick_s = 5e-9;
  if (result.mode != reference.mode || result.peaks.size() != reference.peaks.size()) {
    ++errors.grazing;
    return;
  }
  const auto raise = [](double& largest, double value, double exact, double scale) {
    largest = std::max(largest, std::abs(value - exact) / (scale == 0.0 ? 1.0 : scale));
  };
  for (std::size_t i = 0; i < result.peaks.size(); ++i) {
    if (reference.peaks[i].major) {
      const double exact_N = reference.peaks[i].fn_N;
      raise(errors.peaks, result.peaks[i].fn_N, exact_N, reference.fn_peak_N);
      raise(errors.each_peak, result.peaks[i].fn_N, exact_N, exact_N);
    }
  }
  raise(errors.duration, result.duration_s, reference.duration_s, reference.duration_s);
  raise(errors.slide, result.slide_m, reference.slide_m, reference.slide_m);
  raise(errors.stick_s, result.stick_total_s, reference.stick_total_s, 1.0);
  raise(errors.exit_m_s, result.vt_out_m_s, reference.vt_out_m_s, 1.0);
  raise(errors.exit_m_s, result.vn_out_m_s, reference.vn_out_m_s, 1.0);
  if (std::abs(result.stick_total_s - reference.stick_total_s) > kLateStick_s) {
    ++errors.late_sticks;
  }
}

/// Returns the errors for each step factor of the case.
std::vector<StepErrors> step_errors(const StepCase& of) {
  constexpr double kReferenceFactor = 1.0 / 6.0;
  const auto fallen = fall_of(of.model);
  const auto points = step_points(of, fallen->fall().largest_drop_m());
  const solver::StepChoice choice(fallen->chain(), of.model);
  const auto solved = [&](double factor) {
    auto stepped = of.model;
    stepped.step_factor = factor;
    return contacts_of(solver::Finger(stepped, fallen), points);
  };
  const auto reference = solved(kReferenceFactor);
  std::vector<StepErrors> all;
  for (const double factor : of.factors) {
    auto& errors = all.emplace_back();
    const auto results = solved(factor);
    for (std::size_t i = 0; i < results.size(); ++i) {
      judge(results[i], reference[i], errors);
      if (results[i].solver.dt_s > errors.step_s) {
        errors.step_s = results[i].solver.dt_s;
        errors.of_limit = errors.step_s / choice.contact_limits(points[i].e_star).compression_s;
      }
    }
  }
  return all;
}

void study_steps() {
  protocol::Table table;
  for (const char* column : {"model", "points", "step [us]", "of limit", "peaks", "each peak",
                             "duration", "slide", "stick [s]", "exit [m/s]", "> 5 ns", "grazing"}) {
    table.columns.emplace_back(column);
  }
  const auto cases = step_cases();
  std::vector<std::future<std::vector<StepErrors>>> solving;
  for (const auto& of : cases) {
    solving.push_back(std::async(std::launch::async, [&of] { return step_errors(of); }));
  }
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const auto all = solving[i].get();
    for (std::size_t j = 0; j < all.size(); ++j) {
      const double factor = cases[i].factors[j];
      const auto& errors = all[j];
      auto& row = table.rows.emplace_back();
      row.emplace_back(factor == 1.0
                           ? cases[i].name
                           : fmt::format("{}, {} h", cases[i].name, exact_number(factor)));
      row.emplace_back(static_cast<std::int64_t>(cases[i].points));
      row.emplace_back(solver::readable_number(1e6 * errors.step_s, 3));
      row.emplace_back(fixed_number(errors.of_limit, 2));
      for (const double error : {errors.peaks, errors.each_peak, errors.duration, errors.slide,
                                 errors.stick_s, errors.exit_m_s}) {
        row.emplace_back(fmt::format("{:.1e}", error));
      }
      row.emplace_back(errors.late_sticks);
      row.emplace_back(errors.grazing);
    }
  }
  print(std::cout, table, Format::kTable);
}

}  // namespace
}  // namespace oblique::client

int main(int argc, char** argv) {
  const std::string_view study = argc == 2 ? argv[1] : "";
  if (study != "mesh" && study != "steps") {
    std::cerr << oblique::client::kHelp;
    return study == "--help" ? 0 : 2;
  }
  try {
    study == "mesh" ? oblique::client::study_meshes() : oblique::client::study_steps();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
