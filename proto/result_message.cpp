#include "proto/result_message.h"

namespace oblique::protocol {
namespace {

void add_peaks(const solver::CaseResult& result, PointResult& message) {
  for (std::size_t i = 0; i < result.peaks.size(); ++i) {
    const solver::Peak& peak = result.peaks[i];
    message.add_peaks(peak.t_s);
    message.add_peaks(peak.fn_N);
    message.add_peaks(peak.ft_N);
    if (peak.major) {
      message.add_major_peaks(static_cast<std::uint32_t>(i));
    }
  }
  for (const solver::TangentialPeak& peak : result.ft_peaks) {
    message.add_ft_peaks(peak.t_s);
    message.add_ft_peaks(peak.ft_N);
  }
}

void add_intervals(const solver::CaseResult& result, PointResult& message) {
  for (const solver::Phase& phase : result.phases) {
    message.add_phase_ends_s(phase.t1_s);
  }
  for (const solver::StickInterval& interval : result.stick_intervals) {
    message.add_stick_intervals(interval.t0_s);
    message.add_stick_intervals(interval.t1_s);
  }
}

void add_reaction_peaks(const solver::CaseResult& result, PointResult& message) {
  for (const solver::ReactionPeak& peak : result.reaction_peaks) {
    message.add_reaction_peaks(peak.t_s);
    message.add_reaction_peaks(peak.force_N);
  }
}

void add_energy(const solver::ContactEnergy& energy, PointResult& message) {
  message.set_kinetic_in_j(energy.kinetic_in_J);
  message.set_friction_j(energy.friction_J);
  message.set_restitution_j(energy.restitution_J);
  message.set_kinetic_change_j(energy.kinetic_change_J);
  message.set_strain_change_j(energy.strain_change_J);
  message.set_gravity_change_j(energy.gravity_change_J);
  message.set_exchanged_j(energy.exchanged_J);
  message.set_closure(energy.closure);
}

}  // namespace

PointResult to_message(std::uint64_t point, const solver::CaseResult& result) {
  PointResult message;
  message.set_point(point);
  message.set_fall_time_s(result.fall_time_s);
  message.set_impact_x_m(result.impact_x_m);
  message.set_vt_in_m_s(result.vt_in_m_s);
  message.set_vn_in_m_s(result.vn_in_m_s);
  message.set_duration_s(result.duration_s);
  message.set_fn_peak_n(result.fn_peak_N);
  message.set_ft_peak_n(result.ft_peak_N);
  message.set_impulse_n_ns(result.impulse_n_Ns);
  message.set_impulse_t_ns(result.impulse_t_Ns);
  message.set_slide_m(result.slide_m);
  message.set_vt_out_m_s(result.vt_out_m_s);
  message.set_vn_out_m_s(result.vn_out_m_s);
  message.set_mode(result.mode);
  message.set_major_mode(result.major_mode);
  message.set_stick_total_s(result.stick_total_s);
  add_peaks(result, message);
  add_intervals(result, message);
  add_reaction_peaks(result, message);
  add_energy(result.energy, message);
  message.set_dt_s(result.solver.dt_s);
  message.set_steps(static_cast<std::uint64_t>(result.solver.steps));
  message.set_wall_s(result.solver.wall_s);
  return message;
}

PointResult failed_point(std::uint64_t point, const std::string& reason) {
  PointResult message;
  message.set_point(point);
  message.set_error(reason.empty() ? "unknown" : reason);
  return message;
}

}  // namespace oblique::protocol
