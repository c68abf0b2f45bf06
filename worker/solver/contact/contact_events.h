#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "worker/solver/contact/contact_law.h"

namespace oblique::solver {

/// What ends a stretch of smooth motion. The order is the order in which events that fall together
/// (within kSimultaneous_s) are taken: one that comes first may make a later one void.
enum class ContactEvent {
  kSeparation,          ///< restitution: F_n falls to 0
  kTurn,                ///< V_n changes sign: compression <-> restitution
  kSlipForward,         ///< stick: -F_t reaches mu F_n from below; P starts to slide towards +x
  kSlipBackward,        ///< stick: F_t reaches mu F_n from below; P starts to slide towards -x
  kStick,               ///< slip: P's velocity falls to 0
  kTangentialExtremum,  ///< stick: V_t changes sign; an extremum of F_t, no change of regime
};

inline constexpr double kSimultaneous_s = 1e-12;

/// Function whose rise through zero from below is the event, and its time derivative where that
/// depends on velocities alone.
struct EventFunction {
  double value;
  double rate;  ///< zero for functions of velocity, whose rate needs accelerations
};

/// True for events defined by forces (affine in the tip's position), false for those defined by
/// velocities.
bool is_force_event(ContactEvent event);

/// Events possible in the present regime.
struct PossibleEvents {
  std::array<ContactEvent, 5> events;
  std::size_t count;
};
PossibleEvents possible_events(const ContactLaw& law);

/// phi of one event. `vt_sign` is the sign of V_t at the start of the step (for the extremum).
EventFunction event_function(const ContactLaw& law, ContactEvent event, const TipState& tip,
                             double vt_sign);

/// Where, in (0, 1] of a step, phi first rises through zero, judged from the step's two ends by a
/// polynomial: cubic Hermite for force events; for velocity events the quadratic with the same
/// mean as the velocity has over the step. Nothing when it does not.
struct EventGuess {
  double fraction;   ///< of the step
  double slope;      ///< d phi / d fraction there
  bool inside_only;  ///< phi is negative at both ends: the crossing rests on the polynomial alone
  double peak_fraction;  ///< where the polynomial is largest; meaningful with inside_only
};

/// `fresh`: the event's complement has just happened, so that phi starts at zero and a crossing at
/// the start does not count.
std::optional<EventGuess> guess_event(const ContactLaw& law, ContactEvent event,
                                      const TipState& start, const TipState& end, double h_s,
                                      double vt_sign, bool fresh);

}  // namespace oblique::solver
