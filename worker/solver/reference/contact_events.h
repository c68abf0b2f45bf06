#pragma once

#include <array>
#include <optional>

#include "worker/solver/reference/contact_law.h"

namespace oblique::solver {

/// What ends a stretch of smooth motion. The order is the order in which events that fall together
/// (within kSimultaneous_s) are taken: one that comes first may make a later one void.
enum class ContactEvent {
  kSeparation,          ///< eq. 25, restitution: F_n falls to 0
  kTurn,                ///< eq. 22, V_n changes sign: compression <-> restitution
  kSlipForward,         ///< eq. 23, stick: -F_t reaches mu F_n from below; P slides towards +x
  kSlipBackward,        ///< eq. 23, stick: F_t reaches mu F_n from below; P slides towards -x
  kStick,               ///< eq. 24, slip: P's velocity falls to 0
  kTangentialExtremum,  ///< stick: V_t changes sign; an extremum of F_t, no change of regime
};
inline constexpr std::array kContactEvents{
    ContactEvent::kSeparation,   ContactEvent::kTurn,  ContactEvent::kSlipForward,
    ContactEvent::kSlipBackward, ContactEvent::kStick, ContactEvent::kTangentialExtremum};

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

/// Whether the event can happen in the present regime.
bool is_possible(const ContactLaw& law, ContactEvent event);

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

/// Whether the polynomials of all possible events stay clearly below zero, so that guess_event
/// finds none: so it is in nearly all steps, and this costs a tenth. Bernstein coefficients tell,
/// times the step where they hold velocities.
inline bool is_far_from_events(const ContactLaw& law, const TipState& start, const TipState& end,
                               double h_s, double vt_sign) {
  const auto velocity_stays_below = [h_s](double first, double last, double path_m) {
    return first < 0.0 && last < 0.0 && 6.0 * path_m < h_s * (first + 2.0 * last) &&
           6.0 * path_m < h_s * (2.0 * first + last);
  };
  const auto force_stays_below = [h_s](double first, double rate0, double last, double rate1) {
    return first < 0.0 && last < 0.0 && 3.0 * first + h_s * rate0 < 0.0 &&
           3.0 * last - h_s * rate1 < 0.0;
  };
  const double turn = law.is_compression() ? 1.0 : -1.0;
  if (!velocity_stays_below(turn * start.vy_m_s, turn * end.vy_m_s, turn * (end.y_m - start.y_m))) {
    return false;
  }
  const double fn0 = law.fn_N(start);
  const double fn1 = law.fn_N(end);
  const double fn_rate0 = law.fn_rate_N_s(start);
  const double fn_rate1 = law.fn_rate_N_s(end);
  if (!law.is_compression() && !force_stays_below(-fn0, -fn_rate0, -fn1, -fn_rate1)) {
    return false;
  }
  if (!law.is_stick()) {
    const double against = -law.slip_direction();
    TipState path{};  // as if it were a velocity
    path.vx_m_s = end.x_m - start.x_m;
    path.vy_m_s = end.y_m - start.y_m;
    return velocity_stays_below(against * law.slip_velocity_m_s(start),
                                against * law.slip_velocity_m_s(end),
                                against * law.slip_velocity_m_s(path));
  }
  const double mu = law.mu();
  const auto stays_inside = [&](double side) {
    return force_stays_below(
        side * law.ft_N(start) - mu * fn0, side * law.ft_rate_N_s(start) - mu * fn_rate0,
        side * law.ft_N(end) - mu * fn1, side * law.ft_rate_N_s(end) - mu * fn_rate1);
  };
  return stays_inside(-1.0) && stays_inside(1.0) &&
         velocity_stays_below(-vt_sign * start.vx_m_s, -vt_sign * end.vx_m_s,
                              -vt_sign * (end.x_m - start.x_m));
}

}  // namespace oblique::solver
