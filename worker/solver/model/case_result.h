#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::solver {

/// A local maximum of F_n.
struct Peak {
  double t_s;   ///< since touch
  double fn_N;  ///< normal force at t_s
  double ft_N;  ///< largest |F_t| between the valleys of F_n on either side
  bool major;   ///< not removed as a ripple of F_n
};

/// A local maximum of |F_t|.
struct TangentialPeak {
  double t_s;
  double ft_N;
};

enum class PhaseKind { kCompression, kRestitution };

/// "compression" or "restitution".
constexpr std::string_view phase_kind_name(PhaseKind kind) {
  return kind == PhaseKind::kCompression ? "compression" : "restitution";
}

struct Phase {
  PhaseKind kind;
  double t0_s;
  double t1_s;
  double fn_end_N = 0.0;  ///< F_n at t1_s
};

/// A span in which P does not move.
struct StickInterval {
  double t0_s;
  double t1_s;
};

/// Largest reaction at the pin or a joint during a contact: the force on the outer link.
struct ReactionPeak {
  double t_s;
  double force_N;  ///< magnitude
};

/// Energy balance of one contact. Losses are positive.
struct ContactEnergy {
  double kinetic_in_J;   ///< kinetic energy of the whole finger at touch
  double friction_J;     ///< dissipated by friction at P
  double restitution_J;  ///< dissipated by the hysteresis of the normal element
  double kinetic_change_J;
  double strain_change_J;
  double gravity_change_J;
  double exchanged_J;  ///< integral of |F_n V_n| + |F_t V_t|
  double closure;      ///< error of the balance, relative to exchanged_J; never negative
};

/// Estimated errors of outputs (worker/solver/estimate.h), dimensionless and never negative. Absent
/// when not requested, or when the coarser solution of the point has no answer.
struct ErrorEstimate {
  std::optional<std::int64_t> mode_same;  ///< 1: both solutions have the same major mode, else 0
  std::optional<double> fn_peak;
  std::optional<double> ft_peak;
  std::optional<double> duration;
  std::optional<double> stick_total;
  std::optional<double> slide;
  std::optional<double> impulse_n;
  std::optional<double> impulse_t;
  std::optional<double> v_out;  ///< error of the exit velocity as a vector

  bool operator==(const ErrorEstimate&) const = default;
};

struct SolverReport {
  std::string integrator;
  double dt_s;          ///< time step in compression; shorter in restitution at low e*
  std::int64_t steps;   ///< accepted steps in contact
  double wall_s;        ///< wall time of the contact; not reproducible
  std::string version;  ///< solver version
};

/// The result of one point. SI units; times count from touch unless named otherwise.
struct CaseResult {
  double H_m;
  double mu;
  double e_star;
  double fall_time_s;
  double impact_x_m;
  double vt_in_m_s;  ///< tip velocity at touch, tangential (x)
  double vn_in_m_s;  ///< tip velocity at touch, normal (y)
  double duration_s;
  double fn_peak_N;
  double ft_peak_N;
  std::vector<Peak> peaks;
  std::vector<TangentialPeak> ft_peaks;
  double impulse_n_Ns;
  double impulse_t_Ns;
  double slide_m;  ///< path length of P
  double vt_out_m_s;
  double vn_out_m_s;
  std::string mode;        ///< states in order of time, such as "SC SR sR sC sR"
  std::string major_mode;  ///< mode without the ripples of F_n
  /// Smallest distance from a change in the order of events, dimensionless, >= 0; near 0 the mode
  /// is unreliable. margin_event is the event that nearly changed the order.
  std::optional<double> margin;
  std::optional<std::string> margin_event;
  double stick_total_s;
  std::vector<StickInterval> stick_intervals;
  std::vector<Phase> phases;
  std::vector<ReactionPeak> reaction_peaks;  ///< O first, then each joint
  ContactEnergy energy;
  ErrorEstimate errors;
  SolverReport solver;
};

/// The result of a point, or its error.
struct Outcome {
  std::uint64_t number;  ///< the caller's number of the point
  std::optional<CaseResult> result;
  std::string error;  ///< sentence that says why there is no result; else empty
};

}  // namespace oblique::solver
