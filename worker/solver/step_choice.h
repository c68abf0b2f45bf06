#pragma once

#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/contact_law.h"

namespace oblique::solver {

/// Step lengths: what the user asked for, or what is chosen for the integrator.
///
/// Explicit: the longest step that keeps the model's tolerance by an error model, on
///
///   error = kErrorFactor (omega_tip h)^3 (omega_max h),
///
/// and stays below kLongestFraction of the stability limit, which is PEFRL's omega h over
/// omega_max; a longer step asked for is refused above the limit. omega_max is the highest
/// frequency of the chain, in contact with its tip on the stiffest contact spring, omega_tip that
/// of the tip's own inertia on that spring in compression. Generalized-alpha: fractions of the
/// times that the motion itself takes, on any mesh. accuracy.md has what the numbers were measured
/// by.
class StepChoice {
 public:
  static constexpr double kErrorFactor = 0.045;
  /// Steps chosen, or made longer by a step factor, stay below this fraction of the stability
  /// limit.
  static constexpr double kLongestFraction = 0.9;
  /// In the fall: fraction of the stability limit, and the tolerance that it is good for; for
  /// another one it follows by order 4, up to kLongestFraction.
  static constexpr double kFallFraction = 0.5;
  static constexpr double kFallTolerance = 3e-7;
  /// Generalized-alpha at the default tolerance: fraction of sqrt(length/g) in the fall (5 us for
  /// the default model) and of sqrt(mass of the last link/k) in contact (0.1 us).
  static constexpr double kImplicitFallFraction = 1.0 / 40'000.0;
  static constexpr double kImplicitContactFraction = 1.0 / 1500.0;
  /// The restitution spring is e*^-2 times stiffer and its motion e*^-1 times faster. Below this e*
  /// that is faster than the chain's own response to contact, and steps shrink with e*.
  static constexpr double kFastRestitution = 0.4;
  /// Compression, which is as fast at any e*, has shorter steps only for the vibrations that
  /// restitution leaves in it: no shorter ones than for this e*.
  static constexpr double kFastestForCompression = 0.05;
  /// No contact is shorter than this times sqrt(inertia of the tip/k): compression alone takes a
  /// quarter of the period, pi/2 of it.
  static constexpr double kShortestContact = 0.1;

  /// Throws InputError when model.dt_fall_s is above its limit.
  StepChoice(const Chain& chain, const ModelParameters& model);

  double fall_s() const { return fall_s_; }
  /// Steps in a contact with restitution e_star. Throws InputError when model.dt_s is above its
  /// limit, SolveError when e_star is below kSmallestRestitution and when steps are so short that
  /// the contact could never end with them. The model's step factor counts.
  ContactSteps contact(double e_star) const;
  /// Longest stable steps of the explicit integrator in such a contact. In restitution the tip is
  /// held by k/e*^2.
  ContactSteps contact_limits(double e_star) const;

 private:
  /// Throws SolveError where steps of step_s in compression cannot bring a contact to its end:
  /// sooner than by taking Contact::kMostSteps of them.
  void check_can_end(double step_s) const;
  /// Steps before the step factor counts.
  ContactSteps single_contact(double e_star) const;
  /// `steps`, at most kLongestFraction of the stability limit in such a contact.
  ContactSteps stable(const ContactSteps& steps, double e_star) const;

  const Chain& chain_;
  double k_N_m_;
  double tangential_ratio_;  ///< of the tangential stiffness to k
  Integrator integrator_;
  double asked_contact_s_;
  double tip_inertia_kg_;
  double compression_limit_s_;  ///< of the explicit integrator
  double chosen_contact_s_;     ///< by the tolerance alone, where restitution is not fast
  double step_factor_;
  double rounding_step_s_;  ///< shorter ones do not move the tip
  double fall_s_;
};

}  // namespace oblique::solver
