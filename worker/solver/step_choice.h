#pragma once

#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/contact_law.h"

namespace oblique::solver {

/// Step lengths of a model: those that the user set, or chosen ones (accuracy.md has the
/// measurements behind the constants).
///
/// Explicit integrator: the longest step whose error, by the error model
///
///   error = kErrorFactor (omega_tip h)^3 (omega_max h),
///
/// is the model's tolerance. omega_max is the highest frequency of the chain, in contact with the
/// stiffest contact spring at its tip; omega_tip is that of the tip's own inertia on the spring of
/// compression. Generalized-alpha: fractions of the times of the motion itself, on any mesh.
class StepChoice {
 public:
  static constexpr double kErrorFactor = 0.045;
  /// Steps that are chosen, or lengthened by a step factor, are at most this fraction of the
  /// stability limit.
  static constexpr double kLongestFraction = 0.9;
  /// The step of the fall at the tolerance kFallTolerance, as a fraction of the stability limit. At
  /// other tolerances it is scaled by (tolerance/kFallTolerance)^(1/4), up to kLongestFraction.
  static constexpr double kFallFraction = 0.5;
  static constexpr double kFallTolerance = 3e-7;
  /// Generalized-alpha at the default tolerance: fraction of sqrt(length/g) in the fall (5 us for
  /// the default model) and of sqrt(mass of the last link/k) in contact (0.1 us).
  static constexpr double kImplicitFallFraction = 1.0 / 40'000.0;
  static constexpr double kImplicitContactFraction = 1.0 / 1500.0;
  /// The spring of restitution is e*^-2 times stiffer and its motion e*^-1 times faster. Below this
  /// e* it is faster than the chain's own response to contact, and steps shrink with e*.
  static constexpr double kFastRestitution = 0.4;
  /// In compression, which is equally fast at any e*, shorter steps serve only the vibrations left
  /// by restitution: they are not shorter than for this e*.
  static constexpr double kFastestForCompression = 0.05;
  /// No contact is shorter than this times sqrt(inertia of the tip/k): compression alone takes a
  /// quarter of the period, pi/2 times that.
  static constexpr double kShortestContact = 0.1;

  /// `chain` must outlive this. Throws InputError when model.dt_fall_s is above its limit.
  StepChoice(const Chain& chain, const ModelParameters& model);

  double fall_s() const { return fall_s_; }
  /// Steps in a contact with restitution e_star, times the model's step factor. Throws InputError
  /// when model.dt_s is above its limit, SolveError when e_star is below kSmallestRestitution or
  /// steps are too short: Contact::kMaxSteps of them would pass before the contact can end, or the
  /// tip, fallen by about the chain's length, moves by less than the rounding of its position.
  ContactSteps contact(double e_star) const;
  /// Longest stable steps of the explicit integrator in such a contact. In restitution the
  /// stiffness at the tip is k/e*^2.
  ContactSteps contact_limits(double e_star) const;

 private:
  ContactSteps without_step_factor(double e_star) const;
  ContactSteps stable(const ContactSteps& steps, double e_star) const;

  const Chain& chain_;
  ModelParameters model_;
  double tip_inertia_kg_;
  double compression_limit_s_;  ///< of the explicit integrator
  double chosen_contact_s_;     ///< by the tolerance alone, where restitution is not fast
  double shortest_s_;           ///< shorter steps in compression are an error
  double fall_s_;
};

}  // namespace oblique::solver
