#pragma once

#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/contact_law.h"

namespace oblique::solver {

/// Step lengths of a model, set by the user or chosen by the tolerance (measurements: accuracy.md).
///
/// A step h of the explicit integrator in contact satisfies
///
///   tolerance = kErrorFactor (omega_tip h)^3 (omega_max h)
///
/// with the highest frequency omega_max of the chain on its stiffest contact spring, and the
/// frequency omega_tip of the tip's inertia on the spring of compression. Steps of
/// generalized-alpha do not depend on the mesh. They are fractions of characteristic times of the
/// fall and the contact.
class StepChoice {
 public:
  static constexpr double kErrorFactor = 0.045;
  /// Longest step that is chosen or lengthened by a step factor, relative to the stability limit.
  static constexpr double kLongestFraction = 0.9;
  /// Step of the fall, relative to the stability limit, at the tolerance kFallTolerance. It is
  /// proportional to tolerance^(1/4).
  static constexpr double kFallFraction = 0.5;
  static constexpr double kFallTolerance = 3e-7;
  /// Steps of generalized-alpha at the default tolerance, relative to sqrt(length/g) in the fall (5
  /// us for the default model) and to sqrt(mass of the last link/k) in contact (0.1 us).
  static constexpr double kImplicitFallFraction = 1.0 / 40'000.0;
  static constexpr double kImplicitContactFraction = 1.0 / 1500.0;
  /// Motion on the spring of restitution is 1/e* times faster than in compression. For e* below
  /// this value the motion is faster than the chain's own response, and steps shrink with e*.
  static constexpr double kFastRestitution = 0.4;
  /// For e* below this value steps in compression shrink no further. They only have to resolve the
  /// vibrations that a previous restitution causes.
  static constexpr double kFastestForCompression = 0.05;
  /// Every contact lasts at least this times sqrt(inertia of the tip/k). Its compression alone
  /// takes pi/2 times this square root.
  static constexpr double kShortestContact = 0.1;

  /// `chain` must outlive this. Throws InputError when model.dt_fall_s is above its limit.
  StepChoice(const Chain& chain, const ModelParameters& model);

  double fall_s() const { return fall_s_; }
  /// Returns the steps in a contact with restitution e_star, multiplied by the model's step factor.
  /// Throws InputError when model.dt_s is above its limit. Throws SolveError when e_star is below
  /// kSmallestRestitution, when Contact::kMaxSteps steps cannot reach the end of the contact, or
  /// when the tip moves by less than rounding in a step.
  ContactSteps contact(double e_star) const;
  /// Longest stable steps of the explicit integrator in a contact with restitution e_star.
  ContactSteps contact_limits(double e_star) const;

 private:
  ContactSteps without_step_factor(double e_star) const;
  ContactSteps stable(const ContactSteps& steps, double e_star) const;

  const Chain& chain_;
  ModelParameters model_;
  double tip_inertia_kg_;
  double compression_limit_s_;  ///< longest stable explicit step in compression
  double chosen_contact_s_;     ///< step for the tolerance if e* >= kFastRestitution
  double shortest_s_;           ///< shortest allowed step in compression
  double fall_s_;
};

}  // namespace oblique::solver
