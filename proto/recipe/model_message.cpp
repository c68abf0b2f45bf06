#include "proto/recipe/model_message.h"

namespace oblique::protocol {
namespace {

/// Messages have unsigned numbers, and the struct has `int` and an enumeration: checks the range
/// before the conversion.
int checked_whole_number(std::string_view key, std::uint32_t value) {
  solver::check_value(*solver::find_model_key(key), static_cast<double>(value));
  return static_cast<int>(value);
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
  message.set_tolerance(model.tolerance);
  return message;
}

solver::ModelParameters unjudged_from_message(const ModelParameters& message) {
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
  if (message.tolerance() != 0.0) {
    model.tolerance = message.tolerance();
  }
  return model;
}

solver::ModelParameters from_message(const ModelParameters& message) {
  solver::ModelParameters model = unjudged_from_message(message);
  solver::validate(model);
  return model;
}

}  // namespace oblique::protocol
