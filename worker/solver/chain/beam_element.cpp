#include "worker/solver/chain/beam_element.h"

namespace oblique::solver {

double strain_energy(const GradientCoefficients<double>& g, double half_EA_length, double bending) {
  const auto axial = [&](double zeta) {
    const double p2 = legendre_p2(zeta);
    const double x = g.c[0].x + zeta * g.c[1].x + p2 * g.c[2].x;
    const double y = g.c[0].y + zeta * g.c[1].y + p2 * g.c[2].y;
    const double strain = 0.5 * (x * x + y * y - 1.0);
    return 0.5 * strain * strain;
  };
  const double axial_sum =
      GaussRule::centre_weight * axial(0.0) +
      GaussRule::inner_weight *
          (axial(GaussRule::inner_abscissa) + axial(-GaussRule::inner_abscissa)) +
      GaussRule::outer_weight *
          (axial(GaussRule::outer_abscissa) + axial(-GaussRule::outer_abscissa));
  const double c1_squared = g.c[1].x * g.c[1].x + g.c[1].y * g.c[1].y;
  const double c2_squared = g.c[2].x * g.c[2].x + g.c[2].y * g.c[2].y;
  return half_EA_length * axial_sum + bending * (c1_squared + 3.0 * c2_squared);
}

std::array<std::array<double, 4>, 4> mass_matrix(double mass_per_length, double length) {
  const double l = length;
  const double m = mass_per_length * l / 420.0;
  return {{{m * 156.0, m * 22.0 * l, m * 54.0, m * -13.0 * l},
           {m * 22.0 * l, m * 4.0 * l * l, m * 13.0 * l, m * -3.0 * l * l},
           {m * 54.0, m * 13.0 * l, m * 156.0, m * -22.0 * l},
           {m * -13.0 * l, m * -3.0 * l * l, m * -22.0 * l, m * 4.0 * l * l}}};
}

std::array<std::array<double, 4>, 4> bending_matrix(double length) {
  const double l = length;
  const double b = 1.0 / (l * l * l);
  return {{{b * 12.0, b * 6.0 * l, b * -12.0, b * 6.0 * l},
           {b * 6.0 * l, b * 4.0 * l * l, b * -6.0 * l, b * 2.0 * l * l},
           {b * -12.0, b * -6.0 * l, b * 12.0, b * -6.0 * l},
           {b * 6.0 * l, b * 2.0 * l * l, b * -6.0 * l, b * 4.0 * l * l}}};
}

std::array<std::array<double, 4>, 4> gradient_matrix(double length) {
  const double l = length;
  const double a = 1.0 / (30.0 * l);
  return {{{a * 36.0, a * 3.0 * l, a * -36.0, a * 3.0 * l},
           {a * 3.0 * l, a * 4.0 * l * l, a * -3.0 * l, a * -l * l},
           {a * -36.0, a * -3.0 * l, a * 36.0, a * -3.0 * l},
           {a * 3.0 * l, a * -l * l, a * -3.0 * l, a * 4.0 * l * l}}};
}

std::array<double, 4> uniform_load(double length) {
  return {length / 2.0, length * length / 12.0, length / 2.0, -length * length / 12.0};
}

}  // namespace oblique::solver
