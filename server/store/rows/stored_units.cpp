#include "server/store/rows/stored_units.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "proto/result_message.h"

namespace oblique::server {
namespace {

constexpr std::array kUnits{
    StoredUnit{"fall_time_s", "fall_time", 1e9, Scale::kFall},
    StoredUnit{"impact_x_m", "impact_x", 1e9, Scale::kReach},
    StoredUnit{"vt_in_m_s", "vt_in", 1e8, Scale::kSpeed},
    StoredUnit{"vn_in_m_s", "vn_in", 1e8, Scale::kSpeed},
    StoredUnit{"duration_s", "duration", 1e12, Scale::kDuration},
    StoredUnit{"fn_peak_N", "fn_peak", 1e5, Scale::kForce},
    StoredUnit{"ft_peak_N", "ft_peak", 1e5, Scale::kForce},
    StoredUnit{"major_peak_1_N", "major_peak_1", 1e5, Scale::kForce},
    StoredUnit{"major_peak_2_N", "major_peak_2", 1e5, Scale::kForce},
    StoredUnit{"major_peak_3_N", "major_peak_3", 1e5, Scale::kForce},
    StoredUnit{"major_peak_1_t_s", "major_peak_1_t", 1e12, Scale::kDuration},
    StoredUnit{"major_peak_2_t_s", "major_peak_2_t", 1e12, Scale::kDuration},
    StoredUnit{"major_peak_3_t_s", "major_peak_3_t", 1e12, Scale::kDuration},
    StoredUnit{"impulse_n_Ns", "impulse_n", 1e9, Scale::kImpulse},
    StoredUnit{"impulse_t_Ns", "impulse_t", 1e9, Scale::kImpulse},
    StoredUnit{"slide_m", "slide", 1e11, Scale::kPath},
    StoredUnit{"vt_out_m_s", "vt_out", 1e8, Scale::kSpeed},
    StoredUnit{"vn_out_m_s", "vn_out", 1e8, Scale::kSpeed},
    StoredUnit{"margin", "margin", 1e9, Scale::kOne},
    StoredUnit{"stick_total_s", "stick_total", 1e12, Scale::kDuration},
    StoredUnit{"kinetic_in_J", "kinetic_in", 1e8, Scale::kApproach},
    StoredUnit{"friction_J", "friction", 1e9, Scale::kWork},
    StoredUnit{"restitution_J", "restitution", 1e9, Scale::kWork},
    StoredUnit{"kinetic_change_J", "kinetic_change", 1e9, Scale::kWork},
    StoredUnit{"strain_change_J", "strain_change", 1e9, Scale::kWork},
    StoredUnit{"gravity_change_J", "gravity_change", 1e9, Scale::kWork},
    StoredUnit{"exchanged_J", "exchanged", 1e9, Scale::kWork},
    StoredUnit{"closure", "closure", 1e14, Scale::kOne},
    StoredUnit{"fn_peak_error", "fn_peak_error", 1e9, Scale::kOne},
    StoredUnit{"ft_peak_error", "ft_peak_error", 1e9, Scale::kOne},
    StoredUnit{"duration_error", "duration_error", 1e9, Scale::kOne},
    StoredUnit{"stick_total_error", "stick_total_error", 1e9, Scale::kOne},
    StoredUnit{"slide_error", "slide_error", 1e9, Scale::kOne},
    StoredUnit{"impulse_n_error", "impulse_n_error", 1e9, Scale::kOne},
    StoredUnit{"impulse_t_error", "impulse_t_error", 1e9, Scale::kOne},
    StoredUnit{"v_out_error", "v_out_error", 1e9, Scale::kOne},
    StoredUnit{"dt_s", "dt", 1e15, Scale::kStep},
    StoredUnit{.column = "wall_s", .stored = "wall", .per_unit = 1e9, .follows_accuracy = false}};

static_assert(std::ranges::all_of(kUnits,
                                  [](const StoredUnit& unit) {
                                    return unit.per_unit * protocol::kLargestOutput <
                                           std::numeric_limits<double>::max();
                                  }),
              "the largest output is finite in every unit");

/// What is stored is so many times finer than what is accurate.
constexpr double kFiner = 100.0;
/// Decimals of a list's numbers that are worth more than all bits.
constexpr int kMostDecimals = 5;

}  // namespace

std::span<const StoredUnit> stored_units() {
  return kUnits;
}

double accuracy_of(const solver::ModelParameters& model) {
  return model.dt_s == 0.0 && model.dt_fall_s == 0.0 ? model.tolerance : 0.0;
}

StoredDigits::StoredDigits(const solver::CaseResult& result, double accuracy)
    : accuracy_(accuracy) {
  const double speed_m_s = std::hypot(result.vt_in_m_s, result.vn_in_m_s);
  const auto set = [&](Scale scale, double value) {
    scales_[static_cast<std::size_t>(scale)] = std::abs(value);
  };
  set(Scale::kFall, result.fall_time_s);
  set(Scale::kReach, result.impact_x_m);
  set(Scale::kSpeed, speed_m_s);
  set(Scale::kDuration, result.duration_s);
  set(Scale::kForce, result.fn_peak_N);
  set(Scale::kImpulse, result.impulse_n_Ns);
  set(Scale::kPath, speed_m_s * result.duration_s);
  set(Scale::kApproach, result.energy.kinetic_in_J);
  set(Scale::kWork, result.energy.exchanged_J);
  set(Scale::kStep, result.solver.dt_s);
  set(Scale::kOne, 1.0);
}

int StoredDigits::decimals(const StoredUnit& unit) const {
  const double finest = accuracy_ * scales_[static_cast<std::size_t>(unit.scale)] / kFiner;
  double step = 1.0 / unit.per_unit;
  for (int decimals = 0; decimals <= kMostDecimals; ++decimals) {
    if (step <= finest || !unit.follows_accuracy) {
      return decimals;
    }
    step /= 10.0;
  }
  return kAllDigits;
}

}  // namespace oblique::server
