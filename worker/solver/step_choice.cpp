#include "worker/solver/step_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/reference/contact.h"
#include "worker/solver/reference/pefrl.h"

namespace oblique::solver {
namespace {

constexpr double kPefrlOrder = 4.0;
constexpr double kGeneralizedAlphaOrder = 2.0;

void check_asked(const char* key, double asked_s, double limit_s) {
  if (asked_s > limit_s) {
    throw InputError(std::string(key) + " = " + exact_number(asked_s) +
                     " s is not allowed: the explicit integrator is stable up to " +
                     readable_number(limit_s) + " s here (0 chooses a step)");
  }
}

/// Ratio of the step at the model's tolerance to that at the default, for order `order`.
double at_tolerance(const ModelParameters& model, double order) {
  return std::pow(model.tolerance / ModelParameters().tolerance, 1.0 / order);
}

double limit_s(const Chain& chain, double tip_stiffness_N_m) {
  return Pefrl::stability_limit() / chain.highest_frequency_rad_s(tip_stiffness_N_m);
}

double chosen_fall_s(const Chain& chain, const ModelParameters& model) {
  const bool implicit = model.integrator == Integrator::kGeneralizedAlpha;
  const double longest_s = implicit ? 0.0 : limit_s(chain, 0.0);
  if (model.dt_fall_s != 0.0) {
    if (!implicit) {
      check_asked("dt_fall", model.dt_fall_s, longest_s);
    }
    return model.dt_fall_s;
  }
  // A tolerance looser than the default changes only the contact, so that falls are shared.
  if (implicit) {
    return StepChoice::kImplicitFallFraction * std::sqrt(model.lengths_m.back() / model.g_m_s2) *
           std::min(1.0, at_tolerance(model, kGeneralizedAlphaOrder));
  }
  const double tolerance = std::min(model.tolerance, ModelParameters().tolerance);
  const double fraction = StepChoice::kFallFraction *
                          std::pow(tolerance / StepChoice::kFallTolerance, 1.0 / kPefrlOrder);
  return longest_s * std::min(fraction, StepChoice::kLongestFraction);
}

double chosen_contact_s(const ModelParameters& model, double tip_inertia_kg, double limit_s) {
  if (model.integrator == Integrator::kGeneralizedAlpha) {
    const double link_mass_kg =
        model.rho_kg_m3 * model.A_m2 * model.lengths_m.back() + model.tip_mass_kg;
    return StepChoice::kImplicitContactFraction * std::sqrt(link_mass_kg / model.k_N_m) *
           at_tolerance(model, kGeneralizedAlphaOrder);
  }
  const double tip_rad_s = std::sqrt(model.k_N_m / tip_inertia_kg);
  const double highest_rad_s = Pefrl::stability_limit() / limit_s;
  return std::pow(model.tolerance / StepChoice::kErrorFactor, 1.0 / kPefrlOrder) /
         (std::pow(tip_rad_s, 0.75) * std::pow(highest_rad_s, 0.25));
}

}  // namespace

StepChoice::StepChoice(const Chain& chain, const ModelParameters& model)
    : chain_(chain),
      model_(model),
      tip_inertia_kg_(chain.tip_inertia_kg()),
      compression_limit_s_(limit_s(chain, model.k_N_m * std::max(1.0, 1.0 / model.eta2))),
      chosen_contact_s_(chosen_contact_s(model, tip_inertia_kg_, compression_limit_s_)),
      shortest_s_(std::max(
          kShortestContact / static_cast<double>(Contact::kMaxSteps) *
              std::sqrt(tip_inertia_kg_ / model.k_N_m),
          std::numeric_limits<double>::epsilon() * std::sqrt(chain.length_m() / model.g_m_s2))),
      fall_s_(chosen_fall_s(chain, model)) {}

ContactSteps StepChoice::contact_limits(double e_star) const {
  const double stiffest_N_m = model_.k_N_m * std::max(1.0 / (e_star * e_star), 1.0 / model_.eta2);
  return {compression_limit_s_, limit_s(chain_, stiffest_N_m)};
}

/// Limits `steps` to kLongestFraction of the stability limit.
ContactSteps StepChoice::stable(const ContactSteps& steps, double e_star) const {
  // A spring at the tip adds at most stiffness/tip inertia to the square of the highest frequency.
  // This bound is cheap; the frequency itself would need a search for each e*.
  const double tangential_ratio = 1.0 / model_.eta2;
  const double added_N_m = model_.k_N_m * (std::max(1.0 / (e_star * e_star), tangential_ratio) -
                                           std::max(1.0, tangential_ratio));
  const double part = compression_limit_s_ / Pefrl::stability_limit();
  const double slower = std::sqrt(1.0 + added_N_m / tip_inertia_kg_ * part * part);
  const double longest_s = kLongestFraction * compression_limit_s_;
  return {std::min(steps.compression_s, longest_s),
          std::min(steps.restitution_s, longest_s / slower)};
}

ContactSteps StepChoice::contact(double e_star) const {
  ContactSteps steps = without_step_factor(e_star);
  if (steps.compression_s < shortest_s_) {
    throw SolveError("steps of " + readable_number(steps.compression_s) +
                     " s in contact are too short: a longer dt is needed or, with dt = 0, a " +
                     (model_.k_N_m < 1.0 ? "larger" : "smaller") +
                     " k (k = " + exact_number(model_.k_N_m) + " N/m here)");
  }
  if (model_.step_factor == 1.0) {
    return steps;
  }
  steps.compression_s *= model_.step_factor;
  steps.restitution_s *= model_.step_factor;
  return model_.integrator == Integrator::kExplicit ? stable(steps, e_star) : steps;
}

ContactSteps StepChoice::without_step_factor(double e_star) const {
  const bool is_explicit = model_.integrator == Integrator::kExplicit;
  if (e_star < kSmallestRestitution) {
    throw SolveError("e = " + exact_number(e_star) +
                     " cannot be solved in double precision, because the restitution spring k/e^2 "
                     "is too stiff; e must be at least " +
                     exact_number(kSmallestRestitution));
  }
  if (model_.dt_s != 0.0) {
    if (is_explicit) {
      check_asked("dt", model_.dt_s, contact_limits(e_star).restitution_s);
    }
    return {model_.dt_s, model_.dt_s};
  }
  const auto slower = [](double e) { return std::min(1.0, e / kFastRestitution); };
  if (!is_explicit) {
    return {chosen_contact_s_, chosen_contact_s_ * slower(e_star)};
  }
  const double compression_e_star = std::max(e_star, kFastestForCompression);
  return stable(
      {chosen_contact_s_ * slower(compression_e_star), chosen_contact_s_ * slower(e_star)}, e_star);
}

}  // namespace oblique::solver
