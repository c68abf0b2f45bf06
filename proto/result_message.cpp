#include "proto/recipe/recipe.h"

namespace oblique::protocol {
namespace {

/// Whole numbers travel unsigned and become `int` and an enumeration here: the check comes first.
int checked_whole_number(std::string_view key, std::uint32_t value) {
  solver::check_value(*solver::find_model_key(key), static_cast<double>(value));
  return static_cast<int>(value);
}

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

ModelParameters to_message(const solver::ModelParameters& model) {
  ModelParameters message;
  message.mutable_lengths_m()->Assign(model.lengths_m.begin(), model.lengths_m.end());
  message.set_e_pa(model.E_Pa);
  message.set_a_m2(model.A_m2);
  message.set_i_m4(model.I_m4);
  message.set_rho_kg_m3(model.rho_kg_m3);
  message.set_g_m_s2(model.g_m_s2);
  message.set_elements_per_link(static_cast<std::uint32_t>(model.elements_per_link));
  message.set_k_n_m(model.k_N_m);
  message.set_eta2(model.eta2);
  message.set_tip_mass_kg(model.tip_mass_kg);
  message.set_integrator(static_cast<std::uint32_t>(model.integrator));
  message.set_dt_s(model.dt_s);
  message.set_dt_fall_s(model.dt_fall_s);
  message.set_spectral_radius(model.spectral_radius);
  return message;
}

solver::ModelParameters from_message(const ModelParameters& message) {
  solver::ModelParameters model;
  model.lengths_m.assign(message.lengths_m().begin(), message.lengths_m().end());
  model.E_Pa = message.e_pa();
  model.A_m2 = message.a_m2();
  model.I_m4 = message.i_m4();
  model.rho_kg_m3 = message.rho_kg_m3();
  model.g_m_s2 = message.g_m_s2();
  model.elements_per_link = checked_whole_number("elements_per_link", message.elements_per_link());
  model.k_N_m = message.k_n_m();
  model.eta2 = message.eta2();
  model.tip_mass_kg = message.tip_mass_kg();
  model.integrator =
      static_cast<solver::Integrator>(checked_whole_number("integrator", message.integrator()));
  model.dt_s = message.dt_s();
  model.dt_fall_s = message.dt_fall_s();
  model.spectral_radius = message.spectral_radius();
  solver::validate(model);
  return model;
}

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
