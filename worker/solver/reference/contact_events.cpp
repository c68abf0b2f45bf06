#include "worker/solver/reference/contact_events.h"

#include <cmath>
#include <cstddef>
#include <utility>

namespace oblique::solver {
namespace {

/// a0 + a1 z + a2 z^2 + a3 z^3 on [0, 1].
struct Cubic {
  double a0;
  double a1;
  double a2;
  double a3;

  double at(double z) const { return a0 + z * (a1 + z * (a2 + z * a3)); }
  double slope(double z) const { return a1 + z * (2.0 * a2 + z * 3.0 * a3); }
  bool is_zero() const { return a0 == 0.0 && a1 == 0.0 && a2 == 0.0 && a3 == 0.0; }
  /// Sufficient for being negative on [0, 1]: all Bernstein coefficients are.
  bool is_clearly_negative() const {
    return a0 < 0.0 && 3.0 * a0 + a1 < 0.0 && 3.0 * a0 + 2.0 * a1 + a2 < 0.0 &&
           a0 + a1 + a2 + a3 < 0.0;
  }

  /// Ends of the stretches of [0, 1] on which the cubic is monotone: turning points, then 1.
  struct Stretches {
    std::array<double, 3> end{1.0, 1.0, 1.0};
    std::size_t count = 0;
    void add(double z) {
      if (z > 0.0 && z < 1.0) {
        end[count++] = z;
      }
    }
  };
  Stretches stretches() const {
    Stretches result;
    const double a = 3.0 * a3;
    const double b = 2.0 * a2;
    const double discriminant = b * b - 4.0 * a * a1;
    if (discriminant > 0.0) {
      // The form without cancellation: one root is q/a, the other a1/q; NaN and infinity are out.
      const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
      result.add(q / a);
      result.add(a1 / q);
    }
    if (result.count == 2 && result.end[0] > result.end[1]) {
      std::swap(result.end[0], result.end[1]);
    }
    result.end[result.count++] = 1.0;
    return result;
  }
};

/// Root of a function that rises through zero and is monotone on [low, high]: Newton's steps, and
/// bisection where they leave the bracket.
double rising_root(const Cubic& phi, double low, double high) {
  double z = 0.5 * (low + high);
  for (int i = 0; i < 60 && high - low > 1e-15; ++i) {
    const double value = phi.at(z);
    (value < 0.0 ? low : high) = z;
    const double step = -value / phi.slope(z);
    if (std::abs(step) < 1e-15) {
      return z;
    }
    const double next = z + step;
    z = next > low && next < high ? next : 0.5 * (low + high);
  }
  return high;
}

}  // namespace

bool is_force_event(ContactEvent event) {
  return event == ContactEvent::kSeparation || event == ContactEvent::kSlipForward ||
         event == ContactEvent::kSlipBackward;
}

bool is_possible(const ContactLaw& law, ContactEvent event) {
  switch (event) {
    case ContactEvent::kSeparation:
      return !law.is_compression();
    case ContactEvent::kTurn:
      return true;
    case ContactEvent::kStick:
      return !law.is_stick();
    default:
      return law.is_stick();
  }
}

EventFunction event_function(const ContactLaw& law, ContactEvent event, const TipState& tip,
                             double vt_sign) {
  const double mu = law.mu();
  switch (event) {
    case ContactEvent::kSeparation:
      return {-law.fn_N(tip), -law.fn_rate_N_s(tip)};
    case ContactEvent::kTurn:
      return {law.is_compression() ? tip.vy_m_s : -tip.vy_m_s, 0.0};
    case ContactEvent::kSlipForward:
      return {-law.ft_N(tip) - mu * law.fn_N(tip),
              -law.ft_rate_N_s(tip) - mu * law.fn_rate_N_s(tip)};
    case ContactEvent::kSlipBackward:
      return {law.ft_N(tip) - mu * law.fn_N(tip), law.ft_rate_N_s(tip) - mu * law.fn_rate_N_s(tip)};
    case ContactEvent::kStick:
      return {-law.slip_direction() * law.slip_velocity_m_s(tip), 0.0};
    case ContactEvent::kTangentialExtremum:
      return {-vt_sign * tip.vx_m_s, 0.0};
  }
  return {-1.0, 0.0};
}

namespace {

Cubic event_polynomial(const ContactLaw& law, ContactEvent event, const TipState& start,
                       const TipState& end, double h_s, double vt_sign) {
  const EventFunction f0 = event_function(law, event, start, vt_sign);
  const EventFunction f1 = event_function(law, event, end, vt_sign);
  if (is_force_event(event)) {
    const double r0 = f0.rate * h_s;
    const double r1 = f1.rate * h_s;
    return {f0.value, r0, 3.0 * (f1.value - f0.value) - 2.0 * r0 - r1,
            2.0 * (f0.value - f1.value) + r0 + r1};
  }
  TipState mean = start;
  mean.vx_m_s = (end.x_m - start.x_m) / h_s;
  mean.vy_m_s = (end.y_m - start.y_m) / h_s;
  const double m = event_function(law, event, mean, vt_sign).value;
  return {f0.value, 6.0 * m - 4.0 * f0.value - 2.0 * f1.value,
          3.0 * (f0.value + f1.value) - 6.0 * m, 0.0};
}

}  // namespace

std::optional<EventGuess> guess_event(const ContactLaw& law, ContactEvent event,
                                      const TipState& start, const TipState& end, double h_s,
                                      double vt_sign, bool fresh) {
  const Cubic phi = event_polynomial(law, event, start, end, h_s, vt_sign);
  // Negative as nearly always; what follows costs much more. Zero where the tip does not move along
  // the ground: nothing rises.
  if (phi.is_clearly_negative() || phi.is_zero()) {
    return std::nullopt;
  }
  const bool ends_below = phi.at(1.0) < 0.0;
  if (!fresh && phi.a0 >= 0.0 && (phi.a1 > 0.0 || !ends_below)) {
    return EventGuess{0.0, phi.a1, false, 0.0};
  }
  const auto stretches = phi.stretches();
  double left = 0.0;
  for (std::size_t i = 0; i < stretches.count; ++i) {
    const double right = stretches.end[i];
    const bool rises_from_fresh_start = fresh && left == 0.0 && phi.at(right) >= 0.0;
    if (rises_from_fresh_start && stretches.count == 1) {
      return EventGuess{0.0, phi.a1, false, 0.0};
    }
    if (!rises_from_fresh_start && phi.at(left) < 0.0 && phi.at(right) >= 0.0) {
      const double root = rising_root(phi, left, right);
      return EventGuess{root, phi.slope(root), ends_below, right};
    }
    left = right;
  }
  return std::nullopt;
}

}  // namespace oblique::solver
