#pragma once

#include <array>
#include <optional>

#include "worker/solver/reference/contact_law.h"

namespace oblique::solver {

/// An event that may end a regime. Of events within kSimultaneous_s of each other, the one listed
/// first happens first, because it may cancel a later one.
enum class ContactEvent {
  kSeparation,          ///< eq. 25, restitution: F_n falls to 0
  kTurn,                ///< eq. 22, V_n changes sign: compression <-> restitution
  kSlipForward,         ///< eq. 23, stick: -F_t reaches mu F_n from below; P slides towards +x
  kSlipBackward,        ///< eq. 23, stick: F_t reaches mu F_n from below; P slides towards -x
  kStick,               ///< eq. 24, slip: P's velocity falls to 0
  kTangentialExtremum,  ///< stick: V_t changes sign; extremum of F_t without change of regime
};
inline constexpr std::array kContactEvents{
    ContactEvent::kSeparation,   ContactEvent::kTurn,  ContactEvent::kSlipForward,
    ContactEvent::kSlipBackward, ContactEvent::kStick, ContactEvent::kTangentialExtremum};

inline constexpr double kSimultaneous_s = 1e-12;

/// phi and its time derivative. The event happens when phi rises through zero.
struct EventFunction {
  double value;
  double rate;  ///< 0 for functions of velocity: their rate would need accelerations
};

/// Whether phi is a force, affine in the tip's position; else it is a velocity.
constexpr bool is_force_event(ContactEvent event) {
  return event == ContactEvent::kSeparation || event == ContactEvent::kSlipForward ||
         event == ContactEvent::kSlipBackward;
}

/// Whether the event can happen in the regime of `law`.
inline bool is_possible(const ContactLaw& law, ContactEvent event) {
  return event == ContactEvent::kTurn ||
         (event == ContactEvent::kSeparation ? !law.is_compression()
                                             : (event == ContactEvent::kStick) != law.is_stick());
}

/// Eqs. 22 to 25: phi of one event. `vt_sign` is the sign of V_t at the start of the step.
inline EventFunction event_function(const ContactLaw& law, ContactEvent event, const TipState& tip,
                                    double vt_sign) {
  const auto beyond_cone = [&](double side) {
    return EventFunction{side * law.ft_N(tip) - law.mu() * law.fn_N(tip),
                         side * law.ft_rate_N_s(tip) - law.mu() * law.fn_rate_N_s(tip)};
  };
  switch (event) {
    case ContactEvent::kSeparation:
      return {-law.fn_N(tip), -law.fn_rate_N_s(tip)};
    case ContactEvent::kTurn:
      return {law.is_compression() ? tip.vy_m_s : -tip.vy_m_s, 0.0};
    case ContactEvent::kSlipForward:
      return beyond_cone(-1.0);
    case ContactEvent::kSlipBackward:
      return beyond_cone(1.0);
    case ContactEvent::kStick:
      return {-law.slip_speed_m_s(tip, law.slip_direction()), 0.0};
    case ContactEvent::kTangentialExtremum:
      return {-vt_sign * tip.vx_m_s, 0.0};
  }
  return {-1.0, 0.0};
}

/// A TipState with the displacement of a step in place of the velocity. If phi is a velocity, phi
/// of this state is the integral of phi over the step, because phi is linear.
inline TipState displacement(const TipState& start, const TipState& end) {
  return {start.x_m, start.y_m, end.x_m - start.x_m, end.y_m - start.y_m};
}

/// First zero in (0, 1] of a step at which phi rises, by a polynomial through the step's two ends:
/// cubic Hermite for force events; for velocity events the quadratic with the true mean.
struct EventGuess {
  ContactEvent event;
  double fraction;       ///< of the step
  double slope;          ///< d phi / d fraction at `fraction`
  bool inside_only;      ///< phi is negative at both ends of the step
  double peak_fraction;  ///< maximum of the polynomial; valid with inside_only
};

/// Returns nothing if phi does not rise through zero. `fresh` means that phi starts at zero,
/// because the opposite event has just happened; a zero at the start is then ignored.
std::optional<EventGuess> guess_event(const ContactLaw& law, ContactEvent event,
                                      const TipState& start, const TipState& end, double h_s,
                                      double vt_sign, bool fresh);

/// Whether all Bernstein coefficients of the polynomial of guess_event() are negative. Then the
/// polynomial is negative in the whole step. Coefficients of velocities are multiplied by the step.
[[gnu::always_inline]] inline bool is_far(const ContactLaw& law, ContactEvent event,
                                          const TipState& start, const TipState& end, double h_s,
                                          double vt_sign) {
  const EventFunction f0 = event_function(law, event, start, vt_sign);
  const EventFunction f1 = event_function(law, event, end, vt_sign);
  if (!(f0.value < 0.0 && f1.value < 0.0)) {
    return false;
  }
  if (is_force_event(event)) {
    return 3.0 * f0.value + h_s * f0.rate < 0.0 && 3.0 * f1.value - h_s * f1.rate < 0.0;
  }
  const double path = 6.0 * event_function(law, event, displacement(start, end), vt_sign).value;
  return path < h_s * (f0.value + 2.0 * f1.value) && path < h_s * (2.0 * f0.value + f1.value);
}

/// Whether is_far() holds for all possible events, as in nearly all steps. Ten times faster than
/// guess_event().
inline bool is_far_from_events(const ContactLaw& law, const TipState& start, const TipState& end,
                               double h_s, double vt_sign) {
  const auto far = [&](ContactEvent event) __attribute__((always_inline)) {
    return is_far(law, event, start, end, h_s, vt_sign);
  };
  return far(ContactEvent::kTurn) && (law.is_compression() || far(ContactEvent::kSeparation)) &&
         (law.is_stick() ? far(ContactEvent::kSlipForward) && far(ContactEvent::kSlipBackward) &&
                               far(ContactEvent::kTangentialExtremum)
                         : far(ContactEvent::kStick));
}

}  // namespace oblique::solver
