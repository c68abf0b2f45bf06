// Measures how accurate estimated errors are. Solves random points with estimates, and then on a
// mesh so fine that its results count as exact.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/estimate.h"
#include "worker/solver/solve.h"

namespace oblique::accuracy {
namespace {

using solver::CaseResult;
using solver::ErrorEstimate;
using solver::ModelParameters;

using Results = std::vector<std::optional<CaseResult>>;

struct Settings {
  std::vector<int> meshes{4, 8, 16};
  int truth = 48;
  int points = 500;
  std::uint64_t seed = 2;
  double k_times = 1.0;
  double I_times = 1.0;
  double tip_mass_kg = 0.0;
  int links = 3;
  double least_mu = 0.0;
  double largest_mu = 2.0;
  double least_e = 0.4;
  double largest_e = 1.0;
  std::string integrator = "explicit";
};

ModelParameters model_of(const Settings& settings, int elements_per_link) {
  ModelParameters model = solver::preset("paper");
  model.elements_per_link = elements_per_link;
  model.k_N_m *= settings.k_times;
  model.I_m4 *= settings.I_times;
  model.tip_mass_kg = settings.tip_mass_kg;
  model.lengths_m.resize(static_cast<std::size_t>(settings.links), model.lengths_m.front());
  model.integrator = solver::integrator_named(settings.integrator);
  return model;
}

/// Returns random points. H is between a sixth and 0.96 of the chain's length.
std::vector<solver::Point> random_points(const Settings& settings) {
  constexpr double kLeastDrop = 1.0 / 6.0;
  constexpr double kLargestDrop = 0.96;
  std::mt19937_64 random(settings.seed);
  const auto between = [&](double from, double to) {
    return from + (to - from) * std::ldexp(static_cast<double>(random() >> 11U), -53);
  };
  double length_m = 0.0;
  for (const double link_m : model_of(settings, 1).lengths_m) {
    length_m += link_m;
  }
  std::vector<solver::Point> points;
  for (int i = 0; i < settings.points; ++i) {
    solver::Point point{};
    point.H_m = between(kLeastDrop * length_m, kLargestDrop * length_m);
    point.mu = between(settings.least_mu, settings.largest_mu);
    point.e_star = between(settings.least_e, settings.largest_e);
    points.push_back(point);
  }
  return points;
}

Results solve(const ModelParameters& model, const std::vector<solver::Point>& points) {
  Results results;
  for (solver::Outcome& outcome : solver::solve_points(solver::Finger(model), points)) {
    results.push_back(std::move(outcome.result));
  }
  return results;
}

/// An output with its estimated error. `difference` compares two results, in the estimate's unit.
struct Output {
  std::string_view name;
  std::optional<double> ErrorEstimate::*estimate;
  double (*difference)(const CaseResult& a, const CaseResult& b);
};

constexpr std::array kOutputs{
    Output{"fn_peak", &ErrorEstimate::fn_peak,
           [](const CaseResult& a, const CaseResult& b) {
             return (a.fn_peak_N - b.fn_peak_N) / a.fn_peak_N;
           }},
    Output{"ft_peak", &ErrorEstimate::ft_peak,
           [](const CaseResult& a, const CaseResult& b) {
             return (a.ft_peak_N - b.ft_peak_N) / a.fn_peak_N;
           }},
    Output{"duration", &ErrorEstimate::duration,
           [](const CaseResult& a, const CaseResult& b) {
             return (a.duration_s - b.duration_s) / a.duration_s;
           }},
    Output{"stick_total", &ErrorEstimate::stick_total,
           [](const CaseResult& a, const CaseResult& b) {
             return (a.stick_total_s - b.stick_total_s) / a.duration_s;
           }},
    Output{"slide", &ErrorEstimate::slide,
           [](const CaseResult& a, const CaseResult& b) {
             return (a.slide_m - b.slide_m) / a.slide_m;
           }},
    Output{"impulse_n", &ErrorEstimate::impulse_n,
           [](const CaseResult& a, const CaseResult& b) {
             return (a.impulse_n_Ns - b.impulse_n_Ns) / a.impulse_n_Ns;
           }},
    Output{"impulse_t", &ErrorEstimate::impulse_t,
           [](const CaseResult& a, const CaseResult& b) {
             return (a.impulse_t_Ns - b.impulse_t_Ns) / a.impulse_n_Ns;
           }},
    Output{"v_out", &ErrorEstimate::v_out, [](const CaseResult& a, const CaseResult& b) {
             return std::hypot(a.vt_out_m_s - b.vt_out_m_s, a.vn_out_m_s - b.vn_out_m_s) /
                    std::hypot(a.vt_in_m_s, a.vn_in_m_s);
           }}};

/// Errors below this value are due to rounding.
constexpr double kRounding = 1e-9;

double quantile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values.empty()
             ? 0.0
             : values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

struct Judged {
  double estimate;
  double truth;
};

std::string row_of(std::string_view name, const std::vector<Judged>& judged) {
  std::vector<double> estimates;
  std::vector<double> truths;
  std::vector<double> ratios;
  int within = 0;
  int within_twice = 0;
  for (const Judged& one : judged) {
    estimates.push_back(one.estimate);
    truths.push_back(one.truth);
    within += one.truth <= one.estimate + kRounding ? 1 : 0;
    within_twice += one.truth <= 2.0 * one.estimate + kRounding ? 1 : 0;
    if (one.estimate > kRounding) {
      ratios.push_back(one.truth / one.estimate);
    }
  }
  const double percent = 100.0 / static_cast<double>(judged.size());
  return fmt::format("| {} | {:.1e} | {:.1e} | {:.1f} | {:.1f} | {:.2f} |\n", name,
                     quantile(truths, 0.5), quantile(estimates, 0.5), percent * within,
                     percent * within_twice, quantile(ratios, 0.5));
}

void print_modes(const Results& results, const Results& truth,
                 const std::vector<ErrorEstimate>& errors) {
  // Number of points by [companion has the same mode][exact result has the same mode].
  std::array<std::array<int, 2>, 2> count{};
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i] && truth[i] && errors[i].mode_same) {
      const bool right = results[i]->major_mode == truth[i]->major_mode;
      ++count.at(*errors[i].mode_same == 1 ? 1 : 0).at(right ? 1 : 0);
    }
  }
  for (const std::size_t same : {1U, 0U}) {
    fmt::print("mode_same = {}: {} points, {} of them in the true mode\n", same,
               count.at(same)[0] + count.at(same)[1], count.at(same)[1]);
  }
}

void check_mesh(const ModelParameters& model, const std::vector<solver::Point>& points,
                const Results& truth) {
  const Results results = solve(model, points);
  const Results companions = solve(solver::companion_model(model), points);
  std::vector<ErrorEstimate> errors(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (results[i] && companions[i]) {
      errors[i] = solver::estimated_errors(model, *results[i], *companions[i]);
    }
  }
  fmt::print(
      "\nn = {}\n\n| output | true error, median | estimate, median | within it [%] | within twice "
      "[%] | true/estimate, median |\n|---|---|---|---|---|---|\n",
      model.elements_per_link);
  for (const Output& output : kOutputs) {
    std::vector<Judged> judged;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& estimate = errors[i].*output.estimate;
      if (truth[i] && estimate) {
        judged.push_back({*estimate, std::abs(output.difference(*results[i], *truth[i]))});
      }
    }
    fmt::print("{}", row_of(output.name, judged));
  }
  print_modes(results, truth, errors);
}

void check(const Settings& settings) {
  const auto points = random_points(settings);
  ModelParameters finest = model_of(settings, settings.truth);
  finest.step_factor = 0.5;
  finest.integrator = solver::Integrator::kExplicit;  // faster, at equal accuracy
  const Results truth = solve(finest, points);
  for (const int mesh : settings.meshes) {
    check_mesh(model_of(settings, mesh), points, truth);
  }
}

void add_flags(CLI::App& app, Settings& settings) {
  app.add_option("--meshes", settings.meshes, "elements a link")->delimiter(',');
  app.add_option("--truth", settings.truth, "elements a link of the mesh that counts as converged");
  app.add_option("--points", settings.points, "random points, H, mu and e uniform");
  app.add_option("--seed", settings.seed, "of the points");
  app.add_option("--k-times", settings.k_times, "contact stiffness, in that of the preset paper");
  app.add_option("--I-times", settings.I_times, "second moment of area, the same");
  app.add_option("--tip-mass", settings.tip_mass_kg, "[kg]");
  app.add_option("--links", settings.links, "of 0.4 m each");
  app.add_option("--mu-from", settings.least_mu, "least friction");
  app.add_option("--mu-to", settings.largest_mu, "largest friction");
  app.add_option("--e-from", settings.least_e, "least restitution");
  app.add_option("--e-to", settings.largest_e, "largest restitution");
  app.add_option("--integrator", settings.integrator, "explicit or generalized-alpha");
}

}  // namespace
}  // namespace oblique::accuracy

int main(int argc, char** argv) {
  CLI::App app("How often true errors of contacts are within the estimated ones");
  oblique::accuracy::Settings settings;
  app.option_defaults()->always_capture_default();
  oblique::accuracy::add_flags(app, settings);
  CLI11_PARSE(app, argc, argv);
  oblique::accuracy::check(settings);
  return 0;
}
