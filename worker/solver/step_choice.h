#pragma once

#include "worker/solver/chain/chain.h"
#include "worker/solver/contact/contact_law.h"
#include "worker/solver/model/smallest_restitution.h"

namespace oblique::solver {

/// Step lengths: what the user asked for, or what is chosen for the integrator.
///
/// Explicit: fractions of the stability limit, which is PEFRL's omega h over the highest frequency
/// of the chain, in contact with its tip on the stiffest contact spring; a longer step is refused.
/// Generalized-alpha: fractions of the times that the motion itself takes, on any mesh.
class StepChoice {
 public:
  /// Fractions of the stability limit taken when no step is asked for. Chosen by work and precision
  /// (README.md).
  static constexpr double kFallFraction = 0.5;
  static constexpr double kContactFraction = 0.2;
  /// Generalized-alpha: fraction of sqrt(length/g) in the fall (5 us for the default model) and of
  /// sqrt(mass of the last link/k) in contact (0.1 us).
  static constexpr double kImplicitFallFraction = 1.0 / 40'000.0;
  static constexpr double kImplicitContactFraction = 1.0 / 1500.0;
  /// The restitution spring is e*^-2 times stiffer and its motion e*^-1 times faster. Below this e*
  /// it is faster than the chain's own response to contact, and steps in restitution shrink with
  /// it.
  static constexpr double kFastRestitution = 0.4;
  /// Steps that a step factor above 1 makes longer stay below this fraction of the stability limit.
  static constexpr double kLongestFraction = 0.9;

  /// Throws InputError when model.dt_fall_s is above its limit.
  StepChoice(const Chain& chain, const ModelParameters& model);

  double fall_s() const { return fall_s_; }
  /// Steps in a contact with restitution e_star. Throws InputError when model.dt_s is above its
  /// limit, SolveError when e_star is below kSmallestRestitution. The model's step factor counts.
  ContactSteps contact(double e_star) const;
  /// Longest stable steps of the explicit integrator in such a contact. In restitution the tip is
  /// held by k/e*^2.
  ContactSteps contact_limits(double e_star) const;

 private:
  /// Steps before the step factor counts.
  ContactSteps single_contact(double e_star) const;

  const Chain& chain_;
  double k_N_m_;
  double tangential_ratio_;  ///< of the tangential stiffness to k
  Integrator integrator_;
  double asked_contact_s_;
  double implicit_contact_s_;
  double step_factor_;
  double fall_s_;
};

}  // namespace oblique::solver
