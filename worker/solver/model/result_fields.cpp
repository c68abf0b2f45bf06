#include "worker/solver/model/result_fields.h"

#include <algorithm>
#include <array>

namespace oblique::solver {
namespace {

constexpr std::string_view kEnergy = "energy";
constexpr std::string_view kSolver = "solver";
constexpr bool kOne = false;
constexpr bool kList = true;

constexpr std::array<ResultField, 34> kFields{{
    {"fall_time_s", "", "fall_time_s", "s", "time from rest to touch", kOne},
    {"impact_x_m", "", "impact_x_m", "m",
     "where the tip lands: distance from the pin O along the ground", kOne},
    {"vt_in_m_s", "", "vt_in_m_s", "m/s",
     "tangential velocity of the tip at touch, along x; negative: towards the pin", kOne},
    {"vn_in_m_s", "", "vn_in_m_s", "m/s",
     "normal velocity of the tip at touch, upwards; negative: into the ground", kOne},
    {"duration_s", "", "duration_s", "s", "duration of contact, from touch to separation", kOne,
     "us", 1e6},
    {"fn_peak_N", "", "fn_peak_N", "N",
     "largest normal force; forces act on the tip, the normal one upwards, never negative", kOne},
    {"ft_peak_N", "", "ft_peak_N", "N", "largest magnitude of the tangential force", kOne},
    {"fn_peaks_N", "", "fn_peaks_N", "N",
     "every peak of the normal force, ripples included, in order of time", kList},
    {"ft_peaks_N", "", "ft_peaks_N", "N",
     "every peak of the magnitude of the tangential force, in order of time", kList},
    {"major_peaks_N", "", "major_peaks_N", "N",
     "the peaks of the normal force left when ripples are merged", kList},
    {"impulse_n_Ns", "", "impulse_n_Ns", "N s", "impulse of the normal force, upwards", kOne},
    {"impulse_t_Ns", "", "impulse_t_Ns", "N s",
     "impulse of the tangential force, along x; positive: away from the pin", kOne},
    {"slide_m", "", "slide_m", "m",
     "length of the path of the contact particle P along the ground, there and back both counted",
     kOne, "mm", 1e3},
    {"vt_out_m_s", "", "vt_out_m_s", "m/s",
     "tangential velocity of the tip at separation, along x; negative: towards the pin", kOne},
    {"vn_out_m_s", "", "vn_out_m_s", "m/s",
     "normal velocity of the tip at separation, upwards; positive: off the ground", kOne},
    {"mode", "", "mode", "", "order of states: S stick, s slip; C compression, R restitution",
     kOne},
    {"major_mode", "", "major_mode", "", "the same with ripples merged", kOne},
    {"stick_total_s", "", "stick_total_s", "s", "total time in stick", kOne, "us", 1e6},
    {"stick_intervals_s", "", "stick_intervals_s", "s",
     "spans in which P does not move: [from, to], counted from touch", kList},
    {"phases", "", "phases", "s",
     "intervals of compression and restitution: kind, t0_s, t1_s, counted from touch", kList},
    {"reaction_peaks", "", "reaction_peaks", "s, N",
     "largest force on the outer link at the pin O, then at each joint: t_s, its instant counted "
     "from touch, and force_N, its magnitude",
     kList},
    {"kinetic_in_J", kEnergy, "kinetic_in_J", "J", "kinetic energy of the whole finger at touch",
     kOne},
    {"friction_J", kEnergy, "friction_J", "J",
     "energy lost to friction at P; what is lost is positive", kOne},
    {"restitution_J", kEnergy, "restitution_J", "J",
     "energy lost in the normal contact element; what is lost is positive", kOne},
    {"kinetic_change_J", kEnergy, "kinetic_change_J", "J",
     "kinetic energy at separation less that at touch", kOne},
    {"strain_change_J", kEnergy, "strain_change_J", "J",
     "strain energy of the links at separation less that at touch", kOne},
    {"gravity_change_J", kEnergy, "gravity_change_J", "J",
     "potential energy at separation less that at touch", kOne},
    {"exchanged_J", kEnergy, "exchanged_J", "J",
     "work that the contact forces exchanged with the finger, to and fro both counted", kOne},
    {"closure", kEnergy, "closure", "",
     "what does not add up in the energy balance, relative to exchanged_J; never negative", kOne},
    {"integrator", kSolver, "integrator", "",
     "how the equations of motion are stepped: explicit or generalized-alpha", kOne},
    {"dt_s", kSolver, "dt_s", "s",
     "step in contact, in compression; restitution at low e steps shorter", kOne, "us", 1e6},
    {"steps", kSolver, "steps", "", "accepted steps in contact", kOne},
    {"wall_s", kSolver, "wall_s", "s", "wall time of the contact alone; not reproducible", kOne,
     "ms", 1e3},
    {"version", kSolver, "solver_version", "", "version of the solver", kOne},
}};

}  // namespace

std::span<const ResultField> result_fields() {
  return kFields;
}

const ResultField* find_result_column(std::string_view column) {
  const auto found = std::find_if(kFields.begin(), kFields.end(),
                                  [&](const ResultField& field) { return field.column == column; });
  return found == kFields.end() ? nullptr : &*found;
}

}  // namespace oblique::solver
