#include "worker/solver/step_choice.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "worker/solver/errors.h"
#include "worker/solver/pefrl.h"

namespace oblique::solver {
namespace {

double checked(const char* key, double asked_s, double limit_s, double fraction) {
  if (asked_s == 0.0) {
    return fraction * limit_s;
  }
  if (asked_s > limit_s) {
    std::ostringstream message;
    message << key << " = " << asked_s
            << " s is not allowed: the explicit integrator is stable up to " << limit_s
            << " s here (0 chooses a step)";
    throw InputError(message.str());
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
      stiffest_ratio_(std::max(1.0, 1.0 / model.eta2)),
      integrator_(model.integrator),
      asked_contact_s_(model.dt_s),
      implicit_contact_s_(kImplicitContactFraction * std::sqrt(link_mass_kg(model) / model.k_N_m)),
      fall_s_(chosen_fall_s(chain, model)) {}

double StepChoice::contact_limit_s(double e_star) const {
  const double stiffest_N_m = k_N_m_ * std::max(stiffest_ratio_, 1.0 / (e_star * e_star));
  return Pefrl::stability_limit() / chain_.highest_frequency_rad_s(stiffest_N_m);
}

ContactSteps StepChoice::contact(double e_star) const {
  double step_s = asked_contact_s_ != 0.0 ? asked_contact_s_ : implicit_contact_s_;
  if (integrator_ == Integrator::kExplicit) {
    step_s = checked("dt", asked_contact_s_, contact_limit_s(e_star), kContactFraction);
  }
  if (asked_contact_s_ != 0.0) {
    return {step_s, step_s};
  }
  return {step_s, step_s * std::min(1.0, e_star / kFastRestitution)};
}

}  // namespace oblique::solver
