#include "tests/worker/solver/analytic/analytic_waves.h"

#include <cmath>

namespace oblique::solver {

double mittag_leffler_three_halves(double b, double z) {
  double sum = 0.0;
  double power = 1.0;
  // Terms grow until n is about |z|^(2/3), and then decrease faster than exponentially.
  for (int n = 0; n < 100; ++n) {
    sum += power / std::tgamma(1.5 * n + b);
    power *= z;
  }
  return sum;
}

BeamEndOnSpring::BeamEndOnSpring(double mass_per_length_kg_m, double EI_N_m2, double k_N_m,
                                 double V0_m_s)
    : C_(std::sqrt(2.0) / (std::pow(mass_per_length_kg_m, 0.75) * std::pow(EI_N_m2, 0.25))),
      k_N_m_(k_N_m),
      V0_m_s_(V0_m_s) {}

double BeamEndOnSpring::argument(double t_s) const {
  return -k_N_m_ * C_ * t_s * std::sqrt(t_s);
}

double BeamEndOnSpring::force_N(double t_s) const {
  return k_N_m_ * V0_m_s_ * t_s * mittag_leffler_three_halves(2.0, argument(t_s));
}

double BeamEndOnSpring::force_rate_N_s(double t_s) const {
  return k_N_m_ * V0_m_s_ * mittag_leffler_three_halves(1.0, argument(t_s));
}

double BeamEndOnSpring::peak_time_s() const {
  // The force has its first maximum later than the time at which -k C t^{3/2} is -1.
  const double scale_s = std::pow(k_N_m_ * C_, -2.0 / 3.0);
  double low = scale_s;
  double high = scale_s;
  while (force_rate_N_s(high) > 0.0) {
    low = high;
    high *= 1.1;
  }
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (force_rate_N_s(middle) > 0.0 ? low : high) = middle;
  }
  return high;
}

RodEndOnSpring::RodEndOnSpring(double E_Pa, double A_m2, double rho_kg_m3, double k_N_m,
                               double V0_m_s)
    : c_m_s_(std::sqrt(E_Pa / rho_kg_m3)),
      impedance_Ns_m_(rho_kg_m3 * A_m2 * c_m_s_),
      k_N_m_(k_N_m),
      V0_m_s_(V0_m_s) {}

double RodEndOnSpring::force_N(double t_s) const {
  return -force_without_spring_N() * std::expm1(-k_N_m_ * t_s / impedance_Ns_m_);
}

}  // namespace oblique::solver
