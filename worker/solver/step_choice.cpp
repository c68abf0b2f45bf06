#include "worker/solver/step_choice.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/motion/pefrl.h"

namespace oblique::solver {
namespace {

double checked(const char* key, double asked_s, double limit_s, double fraction) {
  if (asked_s == 0.0) {
    return fraction * limit_s;
  }
  if (asked_s > limit_s) {
    throw InputError(std::string(key) + " = " + exact_number(asked_s) +
                     " s is not allowed: the explicit integrator is stable up to " +
                     readable_number(limit_s) + " s here (0 chooses a step)");
  }
  return asked_s;
}

double chosen_fall_s(const Chain& chain, const ModelParameters& model) {
  if (model.integrator == Integrator::kGeneralizedAlpha) {
    return model.dt_fall_s != 0.0 ? model.dt_fall_s
                                  : StepChoice::kImplicitFallFraction *
                                        std::sqrt(model.lengths_m.back() / model.g_m_s2);
  }
  return checked("dt_fall", model.dt_fall_s,
                 Pefrl::stability_limit() / chain.highest_frequency_rad_s(0.0),
                 StepChoice::kFallFraction);
}

double link_mass_kg(const ModelParameters& model) {
  return model.rho_kg_m3 * model.A_m2 * model.lengths_m.back() + model.tip_mass_kg;
}

}  // namespace

StepChoice::StepChoice(const Chain& chain, const ModelParameters& model)
    : chain_(chain),
      k_N_m_(model.k_N_m),
      tangential_ratio_(1.0 / model.eta2),
      integrator_(model.integrator),
      asked_contact_s_(model.dt_s),
      implicit_contact_s_(kImplicitContactFraction * std::sqrt(link_mass_kg(model) / model.k_N_m)),
      step_factor_(model.step_factor),
      fall_s_(chosen_fall_s(chain, model)) {}

ContactSteps StepChoice::contact_limits(double e_star) const {
  const auto limit_s = [this](double stiffness_ratio) {
    const double stiffest_N_m = k_N_m_ * std::max(stiffness_ratio, tangential_ratio_);
    return Pefrl::stability_limit() / chain_.highest_frequency_rad_s(stiffest_N_m);
  };
  return {limit_s(1.0), limit_s(1.0 / (e_star * e_star))};
}

ContactSteps StepChoice::contact(double e_star) const {
  ContactSteps steps = single_contact(e_star);
  if (step_factor_ == 1.0) {
    return steps;
  }
  steps.compression_s *= step_factor_;
  steps.restitution_s *= step_factor_;
  if (integrator_ == Integrator::kExplicit) {
    const ContactSteps limits = contact_limits(e_star);
    steps.compression_s = std::min(steps.compression_s, kLongestFraction * limits.compression_s);
    steps.restitution_s = std::min(steps.restitution_s, kLongestFraction * limits.restitution_s);
  }
  return steps;
}

ContactSteps StepChoice::single_contact(double e_star) const {
  if (e_star < kSmallestRestitution) {
    throw SolveError("e = " + exact_number(e_star) +
                     " cannot be solved in double precision: the restitution spring k/e^2 is too "
                     "stiff; e from " +
                     exact_number(kSmallestRestitution) + " on can");
  }
  if (asked_contact_s_ != 0.0) {
    if (integrator_ == Integrator::kExplicit) {
      checked("dt", asked_contact_s_, contact_limits(e_star).restitution_s, kContactFraction);
    }
    return {asked_contact_s_, asked_contact_s_};
  }
  const double faster = std::min(1.0, e_star / kFastRestitution);
  if (integrator_ != Integrator::kExplicit) {
    return {implicit_contact_s_, implicit_contact_s_ * faster};
  }
  // Far below kFastRestitution the limit itself falls as e* does.
  const ContactSteps limits = contact_limits(e_star);
  return {kContactFraction * limits.compression_s,
          kContactFraction * std::min(limits.restitution_s, limits.compression_s * faster)};
}

}  // namespace oblique::solver
