#include "worker/solver/reference/contact_events.h"

#include <algorithm>
#include <cmath>

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

  /// Right ends of the intervals of [0, 1] in which the cubic is monotone.
  std::array<double, 3> monotone_ends() const {
    const double a = 3.0 * a3;
    const double b = 2.0 * a2;
    const double discriminant = b * b - 4.0 * a * a1;
    if (!(discriminant > 0.0)) {
      return {1.0, 1.0, 1.0};
    }
    // q/a and a1/q are the roots without cancellation. inside() returns 1 for NaN and infinity.
    const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
    const auto inside = [](double z) { return z > 0.0 && z < 1.0 ? z : 1.0; };
    const auto [first, second] = std::minmax({inside(q / a), inside(a1 / q)});
    return {first, second, 1.0};
  }
};

/// Returns the root of a monotone function that rises through zero in [low, high]. Uses Newton's
/// method, and bisection when a Newton step leaves the bracket.
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
  TipState mean = displacement(start, end);
  mean.vx_m_s /= h_s;
  mean.vy_m_s /= h_s;
  const double m = event_function(law, event, mean, vt_sign).value;
  return {f0.value, 6.0 * m - 4.0 * f0.value - 2.0 * f1.value,
          3.0 * (f0.value + f1.value) - 6.0 * m, 0.0};
}

}  // namespace

std::optional<EventGuess> guess_event(const ContactLaw& law, ContactEvent event,
                                      const TipState& start, const TipState& end, double h_s,
                                      double vt_sign, bool fresh) {
  if (is_far(law, event, start, end, h_s, vt_sign)) {
    return std::nullopt;
  }
  const Cubic phi = event_polynomial(law, event, start, end, h_s, vt_sign);
  if (phi.is_zero()) {  // the tip does not move along the ground
    return std::nullopt;
  }
  const bool ends_below = phi.at(1.0) < 0.0;
  if (!fresh && phi.a0 >= 0.0 && (phi.a1 > 0.0 || !ends_below)) {
    return EventGuess{event, 0.0, phi.a1, false, 0.0};
  }
  double left = 0.0;
  for (const double right : phi.monotone_ends()) {
    const bool rises_from_fresh_start = fresh && left == 0.0 && phi.at(right) >= 0.0;
    if (rises_from_fresh_start && right == 1.0) {
      return EventGuess{event, 0.0, phi.a1, false, 0.0};
    }
    if (!rises_from_fresh_start && phi.at(left) < 0.0 && phi.at(right) >= 0.0) {
      const double root = rising_root(phi, left, right);
      return EventGuess{event, root, phi.slope(root), ends_below, right};
    }
    left = right;
  }
  return std::nullopt;
}

}  // namespace oblique::solver
