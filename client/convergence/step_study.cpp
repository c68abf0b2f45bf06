#include "client/convergence/step_study.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/convergence/parallel.h"
#include "worker/solver/falls.h"
#include "worker/solver/model/number.h"
#include "worker/solver/solve.h"
#include "worker/solver/step_choice.h"

namespace oblique::client {
namespace {

using solver::CaseResult;

constexpr double kReferenceFactor = 1.0 / 6.0;
constexpr double kLeastDrop = 0.17;  // of the largest
constexpr double kLargestDrop = 0.97;
constexpr double kLargestFriction = 2.0;
// Restitution in which steps do not shrink.
constexpr double kLeastUsual = solver::StepChoice::kFastRestitution;

std::vector<CaseResult> solved(const solver::ModelParameters& model,
                               const std::shared_ptr<const solver::FallenChain>& fallen,
                               const std::vector<ContactPoint>& points, double factor) {
  solver::ModelParameters stepped = model;
  stepped.step_factor = factor;
  return contacts_of(solver::Finger(stepped, fallen), points);
}

double relative(double value, double reference) {
  return reference == 0.0 ? std::abs(value) : std::abs(value / reference - 1.0);
}

void raise(double& largest, double error) {
  largest = std::max(largest, error);
}

void judge(const CaseResult& result, const CaseResult& reference, StepErrors& errors) {
  if (result.mode != reference.mode || result.peaks.size() != reference.peaks.size()) {
    ++errors.grazing;
    return;
  }
  for (std::size_t i = 0; i < result.peaks.size(); ++i) {
    if (reference.peaks[i].major) {
      const double error_N = std::abs(result.peaks[i].fn_N - reference.peaks[i].fn_N);
      raise(errors.peaks, error_N / reference.fn_peak_N);
      raise(errors.each_peak, error_N / reference.peaks[i].fn_N);
    }
  }
  raise(errors.duration, relative(result.duration_s, reference.duration_s));
  raise(errors.slide, relative(result.slide_m, reference.slide_m));
  const double stick_s = std::abs(result.stick_total_s - reference.stick_total_s);
  raise(errors.stick_s, stick_s);
  errors.late_sticks += stick_s > kStickBound_s ? 1U : 0U;
  raise(errors.exit_m_s, std::abs(result.vt_out_m_s - reference.vt_out_m_s));
  raise(errors.exit_m_s, std::abs(result.vn_out_m_s - reference.vn_out_m_s));
}

StepStudyResult studied(const StepStudyCase& of) {
  const auto fall = solver::solve_falls({&of.model, 1}).front();
  if (!fall.fallen) {
    throw solver::SolveError(fall.error);
  }
  const auto points = step_study_points(of, fall.fallen->fall().largest_drop_m());
  const auto reference = solved(of.model, fall.fallen, points, kReferenceFactor);
  const solver::StepChoice choice(fall.fallen->chain(), of.model);
  StepStudyResult result{of.name, points.size(), {}};
  for (const double factor : of.factors) {
    StepErrors errors{.factor = factor};
    const auto results = solved(of.model, fall.fallen, points, factor);
    for (std::size_t i = 0; i < results.size(); ++i) {
      judge(results[i], reference[i], errors);
      if (results[i].solver.dt_s > errors.step_s) {
        errors.step_s = results[i].solver.dt_s;
        errors.of_limit = errors.step_s / choice.contact_limits(points[i].e_star).compression_s;
      }
    }
    result.steps.push_back(errors);
  }
  return result;
}

}  // namespace

std::vector<StepStudyCase> step_study_cases(const solver::ModelParameters& model) {
  constexpr std::size_t kManyPoints = 1500;
  constexpr std::size_t kSomePoints = 300;
  std::vector<StepStudyCase> cases;
  const auto vary = [&](std::string name, std::size_t points, auto change) -> StepStudyCase& {
    cases.push_back({std::move(name), model, points, kLeastUsual, 1.0, {1.0}});
    change(cases.back().model);
    return cases.back();
  };
  for (const auto& [n, points] : {std::pair{4, kManyPoints}, {8, 800U}, {16, 300U}, {32, 60U}}) {
    vary(fmt::format("n = {}", n), points, [n = n](auto& m) {
      m.elements_per_link = n;
    }).factors = {0.5, 1.0, 2.0};
  }
  const auto vary_key = [&](std::string_view key, std::initializer_list<double> values) {
    for (const double value : values) {
      vary(fmt::format("{} = {}", key, solver::exact_number(value)), kSomePoints,
           [&](auto& m) { solver::find_model_key(key)->set(m, value); });
    }
  };
  vary_key("k", {1e6, 1e7, 1e8, 1e9});
  vary_key("eta2", {0.2, 5.0});
  vary_key("tip_mass", {0.01, 0.1});
  vary_key("E", {7e8, 7e11});
  vary_key("length", {0.1, 1.0});
  vary("lengths = 0.6,0.4,0.2", kSomePoints, [](auto& m) { m.lengths_m = {0.6, 0.4, 0.2}; });
  vary("lengths = 0.2,0.4,0.6", kSomePoints, [](auto& m) { m.lengths_m = {0.2, 0.4, 0.6}; });
  for (const auto& [least, largest] : {std::pair{0.2, 0.4}, {0.05, 0.2}, {0.001, 0.05}}) {
    auto& range = vary(
        fmt::format("e* from {} to {}", solver::exact_number(least), solver::exact_number(largest)),
        kSomePoints, [](auto&) {});
    range.least_e = least;
    range.largest_e = largest;
  }
  return cases;
}

std::vector<ContactPoint> step_study_points(const StepStudyCase& of, double largest_drop_m) {
  // Additive recurrence with the powers of 1/1.2207, the root of x^4 = x + 1: even in three
  // dimensions whatever the count.
  constexpr double kRoot = 1.2207440846057596;
  const auto part = [](std::size_t i, double step) {
    const double sum = 0.5 + step * static_cast<double>(i + 1);
    return sum - std::floor(sum);
  };
  std::vector<ContactPoint> points;
  for (std::size_t i = 0; i < of.points; ++i) {
    const double drop = kLeastDrop + (kLargestDrop - kLeastDrop) * part(i, 1.0 / kRoot);
    points.push_back({drop * largest_drop_m, kLargestFriction * part(i, std::pow(kRoot, -2.0)),
                      of.least_e + (of.largest_e - of.least_e) * part(i, std::pow(kRoot, -3.0))});
  }
  return points;
}

std::vector<StepStudyResult> step_study(
    const std::vector<StepStudyCase>& cases,
    const std::function<void(const StepStudyResult&)>& after_each) {
  std::vector<StepStudyResult> results(cases.size());
  // The dearest are the finest meshes, which are to start first.
  std::vector<std::size_t> order(cases.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = i;
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return cases[a].model.elements_per_link > cases[b].model.elements_per_link;
  });
  for_each_in_parallel(cases.size(), [&](std::size_t i) {
    results[order[i]] = studied(cases[order[i]]);
    after_each(results[order[i]]);
  });
  return results;
}

void print_step_study(std::ostream& out, const std::vector<StepStudyResult>& results,
                      Format format) {
  protocol::Table table{.columns = {"model", "points", "step [us]", "of limit", "peaks",
                                    "each peak", "duration", "slide", "stick [s]", "exit [m/s]",
                                    "> 5 ns", "grazing"}};
  for (const auto& result : results) {
    for (const auto& step : result.steps) {
      auto& row = table.rows.emplace_back();
      add_value(row, step.factor == 1.0
                         ? result.name
                         : fmt::format("{}, {} h", result.name, solver::exact_number(step.factor)));
      add_value(row, static_cast<std::int64_t>(result.points));
      add_value(row, solver::readable_number(1e6 * step.step_s, 3));
      add_value(row, solver::fixed_number(step.of_limit, 2));
      for (const double error :
           {step.peaks, step.each_peak, step.duration, step.slide, step.stick_s, step.exit_m_s}) {
        add_value(row, fmt::format("{:.1e}", error));
      }
      add_value(row, static_cast<std::int64_t>(step.late_sticks));
      add_value(row, static_cast<std::int64_t>(step.grazing));
    }
  }
  print(out, table, format);
}

}  // namespace oblique::client
