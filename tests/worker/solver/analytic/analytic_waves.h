#pragma once

namespace oblique::solver {

/// End of a semi-infinite Euler beam that moves sideways at V0 and hits a spring of stiffness k at
/// t = 0. The end's velocity drops by C D^{-1/2} F (a half integral over time), so that
///
///   F' = k (V0 - C D^{-1/2} F),   C = sqrt(2) / ((rho A)^{3/4} (E I)^{1/4}),
///   F(t) = k V0 t E_{3/2,2}(-k C t^{3/2}),   F'(t) = k V0 E_{3/2,1}(-k C t^{3/2})
///
/// with the Mittag-Leffler function E_{a,b}(z) = sum_n z^n / Gamma(a n + b).
class BeamEndOnSpring {
 public:
  BeamEndOnSpring(double mass_per_length_kg_m, double EI_N_m2, double k_N_m, double V0_m_s);

  double force_N(double t_s) const;
  double force_rate_N_s(double t_s) const;
  /// Returns the time of the first maximum of the force.
  double peak_time_s() const;
  double peak_N() const { return force_N(peak_time_s()); }

 private:
  double argument(double t_s) const;

  double C_;
  double k_N_m_;
  double V0_m_s_;
};

/// Returns E_{3/2,b}(z) by its series. For |z| <= 20 cancellation costs at most seven digits.
double mittag_leffler_three_halves(double b, double z);

/// End of a rod that moves along its axis at V0 and hits a spring of stiffness k at t = 0:
///
///   F = rho A c V0 (1 - exp(-k t / (rho A c))),   c = sqrt(E / rho),
///
/// until the first wave returns from the other end. On a rigid wall F = rho A c V0 at once.
class RodEndOnSpring {
 public:
  RodEndOnSpring(double E_Pa, double A_m2, double rho_kg_m3, double k_N_m, double V0_m_s);

  double wave_speed_m_s() const { return c_m_s_; }
  /// Impedance rho A c [N s/m].
  double impedance_Ns_m() const { return impedance_Ns_m_; }
  double force_N(double t_s) const;
  double force_without_spring_N() const { return impedance_Ns_m_ * V0_m_s_; }

 private:
  double c_m_s_;
  double impedance_Ns_m_;
  double k_N_m_;
  double V0_m_s_;
};

}  // namespace oblique::solver
