#include "worker/solver/chain/beam_element.h"

namespace oblique::solver {
namespace {

/// Adds the axial forces of the Gauss points at +-zeta, p2 = P2(zeta), half weight `w` = EA l/2
/// times the Gauss weight. The gradient splits into an even and an odd part, so the pair costs
/// little more than one point.
void add_axial_pair(const GradientCoefficients& c, double zeta, double w, GradientCoefficients& f) {
  const double p2 = legendre_p2(zeta);
  const Eigen::Vector2d even = c.col(0) + p2 * c.col(2);
  const Eigen::Vector2d odd = zeta * c.col(1);
  // eps(+-zeta) = mean +- difference, eps = (r'.r' - 1)/2. Summed in the order of the coordinates.
  const double mean = 0.5 * (even.squaredNorm() + odd.x() * odd.x() + odd.y() * odd.y()) - 0.5;
  const double difference = even.dot(odd);
  const Eigen::Vector2d even_force = (2.0 * w * mean) * even + (2.0 * w * difference) * odd;
  const Eigen::Vector2d odd_force = (2.0 * w * mean) * odd + (2.0 * w * difference) * even;
  f.col(0) += even_force;
  f.col(1) += zeta * odd_force;
  f.col(2) += p2 * even_force;
}

}  // namespace

GradientMap gradient_map(double inverse_length) {
  const double a = inverse_length;
  return GradientMap{{-a, 0.0, a, 0.0}, {0.0, -0.5, 0.0, 0.5}, {a, 0.5, -a, 0.5}};
}

GradientCoefficients gradient_coefficients(const ElementCoordinates& q, double inverse_length) {
  GradientCoefficients c;
  c.col(0) = (q.col(2) - q.col(0)) * inverse_length;
  c.col(1) = 0.5 * (q.col(3) - q.col(1));
  c.col(2) = 0.5 * (q.col(1) + q.col(3)) - c.col(0);
  return c;
}

GradientCoefficients elastic_gradient(const GradientCoefficients& c, double half_EA_length,
                                      double bending) {
  GradientCoefficients f;
  const Eigen::Vector2d centre = c.col(0) - 0.5 * c.col(2);
  const double strain = 0.5 * centre.squaredNorm() - 0.5;
  f.col(0) = (half_EA_length * GaussRule::centre_weight * strain) * centre;
  // int kappa^2 dx = (4/l)(c1.c1 + 3 c2.c2), so dU/dc1 = 2 bending c1 and dU/dc2 = 6 bending c2.
  f.col(1) = (2.0 * bending) * c.col(1);
  f.col(2) = (6.0 * bending) * c.col(2) - 0.5 * f.col(0);
  add_axial_pair(c, GaussRule::inner_abscissa, half_EA_length * GaussRule::inner_weight, f);
  add_axial_pair(c, GaussRule::outer_abscissa, half_EA_length * GaussRule::outer_weight, f);
  return f;
}

double strain_energy(const GradientCoefficients& c, double half_EA_length, double bending) {
  const auto axial = [&c](double zeta) {
    const Eigen::Vector2d gradient = c.col(0) + zeta * c.col(1) + legendre_p2(zeta) * c.col(2);
    const double strain = 0.5 * (gradient.squaredNorm() - 1.0);
    return 0.5 * strain * strain;
  };
  const double axial_sum =
      GaussRule::centre_weight * axial(0.0) +
      GaussRule::inner_weight *
          (axial(GaussRule::inner_abscissa) + axial(-GaussRule::inner_abscissa)) +
      GaussRule::outer_weight *
          (axial(GaussRule::outer_abscissa) + axial(-GaussRule::outer_abscissa));
  return half_EA_length * axial_sum +
         bending * (c.col(1).squaredNorm() + 3.0 * c.col(2).squaredNorm());
}

Eigen::Matrix4d mass_matrix(double mass_per_length, double length) {
  const double l = length;
  const double m = mass_per_length * l / 420.0;
  return Eigen::Matrix4d{{m * 156.0, m * 22.0 * l, m * 54.0, m * -13.0 * l},
                         {m * 22.0 * l, m * 4.0 * l * l, m * 13.0 * l, m * -3.0 * l * l},
                         {m * 54.0, m * 13.0 * l, m * 156.0, m * -22.0 * l},
                         {m * -13.0 * l, m * -3.0 * l * l, m * -22.0 * l, m * 4.0 * l * l}};
}

Eigen::Matrix4d bending_matrix(double length) {
  const double l = length;
  const double b = 1.0 / (l * l * l);
  return Eigen::Matrix4d{{b * 12.0, b * 6.0 * l, b * -12.0, b * 6.0 * l},
                         {b * 6.0 * l, b * 4.0 * l * l, b * -6.0 * l, b * 2.0 * l * l},
                         {b * -12.0, b * -6.0 * l, b * 12.0, b * -6.0 * l},
                         {b * 6.0 * l, b * 2.0 * l * l, b * -6.0 * l, b * 4.0 * l * l}};
}

Eigen::Matrix4d gradient_matrix(double length) {
  const double l = length;
  const double a = 1.0 / (30.0 * l);
  return Eigen::Matrix4d{{a * 36.0, a * 3.0 * l, a * -36.0, a * 3.0 * l},
                         {a * 3.0 * l, a * 4.0 * l * l, a * -3.0 * l, a * -l * l},
                         {a * -36.0, a * -3.0 * l, a * 36.0, a * -3.0 * l},
                         {a * 3.0 * l, a * -l * l, a * -3.0 * l, a * 4.0 * l * l}};
}

Eigen::Vector4d uniform_load(double length) {
  return {length / 2.0, length * length / 12.0, length / 2.0, -length * length / 12.0};
}

}  // namespace oblique::solver
