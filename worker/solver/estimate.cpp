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

/// Order in which the error of an output is taken to fall with the mesh. Observed is 3.5 to 5 for
/// the first and 1.5 to 4 for the second. The errors of two meshes have no fixed signs, so their
/// difference may be far smaller than either: a lower order is the safety against that.
constexpr int kSmoothOrder = 2;  ///< largest normal force, duration, slide, impulses
constexpr int kRoughOrder = 1;   ///< what fast vibrations or single events decide
constexpr int kRefinement = 2;

/// (2 l/L)^4, with l the longest element and L the length of a bending wave as fast as the contact:
/// the part of the mesh's error that has no order yet. The end of a beam struck on a spring k
/// answers within (k C)^(-2/3), C = sqrt(2)/((rho A)^(3/4) (E I)^(1/4)); with a mass at the tip the
/// contact is not faster than that mass on the spring. A wave of angular frequency w has the
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

/// What differences are multiplied with, for an output of that order.
double factor(const ModelParameters& model, int order) {
  const ModelParameters companion = companion_model(model);
  const double ratio = static_cast<double>(model.elements_per_link) / companion.elements_per_link;
  return (1.0 + unresolved_waves(companion)) / (std::pow(ratio, order) - 1.0);
}

/// Points that are solved by their own models first and then by the companions of these: chains of
/// two shapes share no lanes.
class EstimatedGroup {
 public:
  EstimatedGroup(const FingerPoints& source, const TakeOutcome& sink)
      : source_(source), sink_(sink) {}

  /// Solves the next points of the source, as many as a group has. Hands those that fail on.
  void solve() {
    solve_points([this] { return next(); },
                 [this](Outcome&& outcome) {
                   Waiting& waiting = points_[outcome.number];
                   waiting.result = std::move(outcome.result);
                   if (!waiting.result) {
                     outcome.number = waiting.number;
                     sink_(std::move(outcome));
                   }
                 });
  }
  /// Solves their companions, and hands all results on.
  void estimate(FallCache& falls) {
    const auto companions = fingers_of(falls);
    std::size_t last = 0;
    solve_points([&] { return next_companion(companions, last); },
                 [this](Outcome&& companion) {
                   Waiting& waiting = points_[companion.number];
                   if (companion.result) {
                     waiting.result->errors = estimated_errors(models_[waiting.model],
                                                               *waiting.result, *companion.result);
                   }
                   hand_on(waiting);
                 });
  }
  bool source_has_ended() const { return source_has_ended_; }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostPoints = 256;
  static constexpr std::chrono::seconds kLongest{1};

  struct Waiting {
    std::size_t model;
    std::uint64_t number;
    Point point;
    std::optional<CaseResult> result;
  };

  std::optional<FingerPoint> next() {
    if (points_.size() >= kMostPoints || Clock::now() - begun_ > kLongest) {
      return std::nullopt;
    }
    auto point = source_();
    if (!point) {
      source_has_ended_ = true;
      return std::nullopt;
    }
    if (models_.empty() || !(models_.back() == point->finger.model())) {
      models_.push_back(point->finger.model());
    }
    points_.push_back({models_.size() - 1, point->number, point->point, std::nullopt});
    point->number = points_.size() - 1;
    return point;
  }

  /// Nothing for a companion without a fall, nor where there is no coarser mesh.
  std::vector<std::optional<Finger>> fingers_of(FallCache& falls) const {
    std::vector<ModelParameters> companions;
    for (const ModelParameters& model : models_) {
      companions.push_back(companion_model(model));
    }
    const std::vector<FallOutcome> fallen = falls.falls(companions);
    std::vector<std::optional<Finger>> fingers;
    for (std::size_t i = 0; i < companions.size(); ++i) {
      const bool is_coarser = companions[i].elements_per_link < models_[i].elements_per_link;
      fingers.push_back(fallen[i].fallen && is_coarser
                            ? std::optional(Finger(companions[i], fallen[i].fallen))
                            : std::nullopt);
    }
    return fingers;
  }

  std::optional<FingerPoint> next_companion(const std::vector<std::optional<Finger>>& companions,
                                            std::size_t& last) {
    for (; last < points_.size(); ++last) {
      Waiting& waiting = points_[last];
      if (!waiting.result) {
        continue;
      }
      if (const auto& finger = companions[waiting.model]) {
        return FingerPoint{*finger, last++, waiting.point};
      }
      hand_on(waiting);
    }
    return std::nullopt;
  }

  void hand_on(Waiting& waiting) { sink_({waiting.number, std::move(waiting.result), {}}); }

  const FingerPoints& source_;
  const TakeOutcome& sink_;
  const Clock::time_point begun_ = Clock::now();
  bool source_has_ended_ = false;
  std::vector<ModelParameters> models_;  ///< those of points that follow each other once
  std::vector<Waiting> points_;
};

/// Nothing where the scale is 0, or the quotient is no number.
std::optional<double> relative(double difference, double scale) {
  const double quotient = std::abs(difference) / std::abs(scale);
  return std::isfinite(quotient) ? std::optional(quotient) : std::nullopt;
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
  // What the steps leave by their choice; steps that the user chose are judged by the difference.
  const double step_error = model.dt_s == 0.0 ? model.tolerance : 0.0;
  const auto error_of = [&](double difference, double scale) {
    auto error = relative(difference, scale);
    if (error && *error > 0.0) {  // without a difference the output is exact, as 0 without friction
      *error += step_error;
    }
    return error;
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
  errors.slide = error(smooth, &CaseResult::slide_m, speed_m_s * result.duration_s);
  errors.impulse_n = error(smooth, &CaseResult::impulse_n_Ns, result.impulse_n_Ns);
  errors.impulse_t = error(smooth, &CaseResult::impulse_t_Ns, result.impulse_n_Ns);
  // Both components carry one vibration, whose phase lets the difference of either pass through 0.
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
  try {
    return fall.fallen
               ? estimated_errors(
                     model, result,
                     Finger(companion, fall.fallen).solve(result.H_m, result.mu, result.e_star))
               : ErrorEstimate{};
  } catch (const SolveError&) {
    return {};
  } catch (const InputError&) {  // beyond the drop of the companion's fall
    return {};
  }
}

void solve_points_with_errors(const FingerPoints& source, FallCache& falls,
                              const TakeOutcome& sink) {
  bool has_ended = false;
  while (!has_ended) {
    EstimatedGroup group(source, sink);
    group.solve();
    group.estimate(falls);
    has_ended = group.source_has_ended();
  }
}

}  // namespace oblique::solver
