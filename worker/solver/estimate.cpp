#include "worker/solver/estimate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

namespace oblique::solver {
namespace {

/// Assumed orders of the mesh's error. Observed orders are higher: 3.5 to 5 for smooth outputs and
/// 1.5 to 4 for rough ones. Lower orders are assumed, because the difference between two meshes may
/// be far smaller than the error of either.
constexpr int kSmoothOrder = 2;  ///< largest normal force, duration, slide, impulses
constexpr int kRoughOrder = 1;   ///< outputs that depend on fast vibrations or single events
constexpr int kRefinement = 2;

/// The part of the mesh's error that does not follow the assumed order: (2 l/L)^4 with the longest
/// element l and the length L of a bending wave as fast as the contact. A beam whose end is struck
/// on a spring k responds within (k C)^(-2/3), C = sqrt(2)/((rho A)^(3/4) (E I)^(1/4)). With a mass
/// m at the tip, the contact takes at least sqrt(m/k). A wave of angular frequency w has the
/// wavenumber (rho A w^2/(E I))^(1/4).
double unresolved_waves(const ModelParameters& model) {
  const double mass_per_length_kg_m = model.rho_kg_m3 * model.A_m2;
  const double bending_N_m2 = model.E_Pa * model.I_m4;
  const double C =
      std::numbers::sqrt2 / (std::pow(mass_per_length_kg_m, 0.75) * std::pow(bending_N_m2, 0.25));
  double frequency_rad_s = std::pow(model.k_N_m * C, 2.0 / 3.0);
  if (model.tip_mass_kg > 0.0) {
    frequency_rad_s = std::min(frequency_rad_s, std::sqrt(model.k_N_m / model.tip_mass_kg));
  }
  const double wavenumber_1_m =
      std::pow(mass_per_length_kg_m / bending_N_m2 * frequency_rad_s * frequency_rad_s, 0.25);
  const double element_m =
      *std::max_element(model.lengths_m.begin(), model.lengths_m.end()) / model.elements_per_link;
  return std::pow(element_m * wavenumber_1_m / std::numbers::pi, 4);
}

/// Estimated error of an output of order `order`, divided by the difference between the meshes.
double factor(const ModelParameters& model, int order) {
  const ModelParameters companion = companion_model(model);
  const double ratio = static_cast<double>(model.elements_per_link) / companion.elements_per_link;
  return (1.0 + unresolved_waves(companion)) / (std::pow(ratio, order) - 1.0);
}

struct SolvedPoint {
  FingerPoint point;
  std::optional<CaseResult> result = {};
  std::optional<Finger> companion = {};  ///< empty if no coarser mesh exists or its fall fails
};

/// Solves points of `source`. Passes failed points to `sink`. Sets `ended` if `source` is empty.
std::vector<SolvedPoint> solve_next(const FingerPoints& source, const TakeOutcome& sink,
                                    bool& ended) {
  using Clock = std::chrono::steady_clock;
  constexpr std::size_t kMaxPoints = 256;
  constexpr std::chrono::seconds kLongest{1};
  std::vector<SolvedPoint> points;
  const auto next = [&, begun = Clock::now()]() -> std::optional<FingerPoint> {
    if (points.size() >= kMaxPoints || Clock::now() - begun > kLongest) {
      return std::nullopt;
    }
    auto point = source();
    ended = !point;
    if (point) {
      points.push_back({*point});
      point->number = points.size() - 1;
    }
    return point;
  };
  solve_points(next, [&](Outcome&& outcome) {
    SolvedPoint& solved = points[outcome.number];
    solved.result = std::move(outcome.result);
    if (!solved.result) {
      sink({solved.point.number, std::nullopt, std::move(outcome.error)});
    }
  });
  return points;
}

/// Sets the companions of points. Consecutive points of one model share a companion.
void set_companions(std::vector<SolvedPoint>& points, FallCache& falls) {
  std::vector<ModelParameters> companions;
  for (const SolvedPoint& solved : points) {
    companions.push_back(companion_model(solved.point.finger.model()));
  }
  const std::vector<FallOutcome> fallen = falls.falls(companions);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ModelParameters& model = points[i].point.finger.model();
    if (i > 0 && points[i - 1].point.finger.model() == model) {
      points[i].companion = points[i - 1].companion;
    } else if (fallen[i].fallen && companions[i].elements_per_link < model.elements_per_link) {
      points[i].companion.emplace(companions[i], fallen[i].fallen);
    }
  }
}

}  // namespace

ModelParameters companion_model(const ModelParameters& model) {
  ModelParameters companion = model;
  companion.elements_per_link = std::max(1, model.elements_per_link / kRefinement);
  companion.step_factor = model.step_factor * kRefinement;
  return companion;
}

ErrorEstimate estimated_errors(const ModelParameters& model, const CaseResult& result,
                               const CaseResult& companion) {
  const double smooth = factor(model, kSmoothOrder);
  const double rough = factor(model, kRoughOrder);
  const double speed_m_s = std::hypot(result.vt_in_m_s, result.vn_in_m_s);
  // Error of automatic steps. The difference includes the error of a step that the user sets.
  const double step_error = model.dt_s == 0.0 ? model.tolerance : 0.0;
  const auto error_of = [&](double difference, double scale) -> std::optional<double> {
    const double error = std::abs(difference) / std::abs(scale);
    if (!std::isfinite(error)) {
      return std::nullopt;
    }
    // An output without a difference is exact, for example a force of 0 without friction.
    return error > 0.0 ? error + step_error : error;
  };
  const auto error = [&](double factor, double CaseResult::*output, double scale) {
    return error_of(factor * (result.*output - companion.*output), scale);
  };
  ErrorEstimate errors;
  errors.mode_same = result.major_mode == companion.major_mode ? 1 : 0;
  errors.fn_peak = error(smooth, &CaseResult::fn_peak_N, result.fn_peak_N);
  errors.ft_peak = error(rough, &CaseResult::ft_peak_N, result.fn_peak_N);
  errors.duration = error(smooth, &CaseResult::duration_s, result.duration_s);
  errors.stick_total = error(rough, &CaseResult::stick_total_s, result.duration_s);
  errors.slide = error(smooth, &CaseResult::slide_m, result.slide_m);
  errors.impulse_n = error(smooth, &CaseResult::impulse_n_Ns, result.impulse_n_Ns);
  errors.impulse_t = error(smooth, &CaseResult::impulse_t_Ns, result.impulse_n_Ns);
  // The difference of one component of the velocity may vanish by chance, that of the vector not.
  errors.v_out = error_of(rough * std::hypot(result.vt_out_m_s - companion.vt_out_m_s,
                                             result.vn_out_m_s - companion.vn_out_m_s),
                          speed_m_s);
  return errors;
}

ErrorEstimate errors_by_companion(const ModelParameters& model, const CaseResult& result,
                                  FallCache& falls) {
  const ModelParameters companion = companion_model(model);
  if (companion.elements_per_link >= model.elements_per_link) {
    return {};
  }
  const FallOutcome fall = falls.falls({&companion, 1}).front();
  if (!fall.fallen) {
    return {};
  }
  const Point point{result.H_m, result.mu, result.e_star};
  const Outcome outcome = solve_points(Finger(companion, fall.fallen), {&point, 1}).front();
  return outcome.result ? estimated_errors(model, result, *outcome.result) : ErrorEstimate{};
}

// Lanes are shared by chains of one shape only, so the companions are solved after the points.
void solve_points_with_errors(const FingerPoints& source, FallCache& falls,
                              const TakeOutcome& sink) {
  for (bool ended = false; !ended;) {
    std::vector<SolvedPoint> points = solve_next(source, sink, ended);
    set_companions(points, falls);
    auto next = points.begin();
    const auto next_companion = [&]() -> std::optional<FingerPoint> {
      next = std::find_if(next, points.end(), [](const SolvedPoint& solved) {
        return solved.result && solved.companion;
      });
      if (next == points.end()) {
        return std::nullopt;
      }
      const auto number = static_cast<std::uint64_t>(next - points.begin());
      return FingerPoint{*next->companion, number, next++->point.point};
    };
    solve_points(next_companion, [&](Outcome&& companion) {
      SolvedPoint& solved = points[companion.number];
      if (companion.result) {
        solved.result->errors =
            estimated_errors(solved.point.finger.model(), *solved.result, *companion.result);
      }
    });
    for (SolvedPoint& solved : points) {
      if (solved.result) {
        sink({solved.point.number, std::move(solved.result), {}});
      }
    }
  }
}

}  // namespace oblique::solver
