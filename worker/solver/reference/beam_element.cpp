#include "worker/solver/reference/beam_element.h"

namespace oblique::solver {
namespace {

PlanarVector<double> pair(const ElementCoordinates& q, Eigen::Index column) {
  return {q(0, column), q(1, column)};
}

}  // namespace

GradientCoefficients gradient_coefficients(const ElementCoordinates& q, double inverse_length) {
  GradientCoefficients c;
  c.col(0) = (q.col(2) - q.col(0)) * inverse_length;
  c.col(1) = 0.5 * (q.col(3) - q.col(1));
  c.col(2) = 0.5 * (q.col(1) + q.col(3)) - c.col(0);
  return c;
}

ElementConstants<double> element_constants(double length_m, double EA_N, double EI_N_m2,
                                           double mass_per_length) {
  const double l = length_m;
  const double S = EA_N * l;
  ElementConstants<double> k{};
  k.inverse_length = 1.0 / l;
  k.axial = S;
  k.bending = 2.0 * EI_N_m2 / l;
  k.two_inverse_length = 2.0 / l;
  k.k00 = -S / (2.0 * l * l);
  k.k00_uu = S / (2.0 * l * l * l * l);
  k.k00_dd = S / (24.0 * l * l);
  k.k00_tt = S / (40.0 * l * l);
  k.k01_ud = S / (12.0 * l * l);
  k.k01_dt = S / (60.0 * l);
  k.k02_ut = S / (20.0 * l * l);
  k.k02_dd = S / (120.0 * l);
  k.k02_tt = S / (280.0 * l);
  k.k11 = 0.5 * k.bending;
  k.k11_k00 = l * l / 12.0;
  k.k11_k02 = l / 3.0;
  k.k12_k01 = l / 5.0;
  k.k12_dt = 9.0 * S / 2800.0;
  k.k22 = 1.5 * k.bending;
  k.k22_k00 = l * l / 20.0;
  k.k22_k02 = l / 7.0;
  k.k22_tt = 9.0 * S / 9800.0;
  const double kg = mass_per_length * l;
  k.m_pp = kg * 13.0 / 35.0;
  k.m_ps = kg * l * 11.0 / 210.0;
  k.m_ss = kg * l * l / 105.0;
  k.n_pp = kg * 9.0 / 70.0;
  k.n_ps = kg * l * 13.0 / 420.0;
  k.n_ss = kg * l * l / 140.0;
  return k;
}

double strain_energy(const ElementCoordinates& q, const ElementConstants<double>& constants) {
  const GradientCoefficients c = gradient_coefficients(q, constants.inverse_length);
  const auto axial = [&c](double zeta) {
    const Eigen::Vector2d gradient = c.col(0) + zeta * c.col(1) + legendre_p2(zeta) * c.col(2);
    const double strain = 0.5 * (gradient.squaredNorm() - 1.0);
    return 0.5 * strain * strain;
  };
  const double axial_sum =
      GaussRule::centre_weight * axial(0.0) +
      GaussRule::inner_weight * (axial(GaussRule::inner) + axial(-GaussRule::inner)) +
      GaussRule::outer_weight * (axial(GaussRule::outer) + axial(-GaussRule::outer));
  // int kappa^2 dx = (4/l)(c1.c1 + 3 c2.c2).
  return 0.5 * constants.axial * axial_sum +
         constants.bending * (c.col(1).squaredNorm() + 3.0 * c.col(2).squaredNorm());
}

ElementCoordinates elastic_gradient(const ElementCoordinates& q,
                                    const ElementConstants<double>& constants) {
  const auto f = elastic_forces(pair(q, 0), pair(q, 1), pair(q, 2), pair(q, 3), constants);
  return ElementCoordinates{{-f.pull.x, f.by_t.x - f.by_d.x, f.pull.x, f.by_t.x + f.by_d.x},
                            {-f.pull.y, f.by_t.y - f.by_d.y, f.pull.y, f.by_t.y + f.by_d.y}};
}

ElementTangent elastic_tangent(const ElementCoordinates& q,
                               const ElementConstants<double>& constants) {
  const auto matrix = [](const SymmetricPair<double>& block) {
    return Eigen::Matrix2d{{block.xx, block.xy}, {block.xy, block.yy}};
  };
  const auto blocks = element_tangent(pair(q, 0), pair(q, 1), pair(q, 2), pair(q, 3), constants);
  const Eigen::Matrix2d pp = matrix(blocks.pp);
  const Eigen::Matrix2d ps_i = matrix(blocks.ps_i);
  const Eigen::Matrix2d ps_j = matrix(blocks.ps_j);
  const Eigen::Matrix2d ss_ij = matrix(blocks.ss_ij);
  ElementTangent K;
  K << pp, ps_i, -pp, ps_j,                      //
      ps_i, matrix(blocks.ss_ii), -ps_i, ss_ij,  //
      -pp, -ps_i, pp, -ps_j,                     //
      ps_j, ss_ij, -ps_j, matrix(blocks.ss_jj);
  return K;
}

ElementTangent in_both_directions(const Eigen::Matrix4d& matrix) {
  ElementTangent both = ElementTangent::Zero();
  for (int direction = 0; direction < 2; ++direction) {
    const auto every_other = Eigen::seqN(direction, Eigen::fix<4>, Eigen::fix<2>);
    both(every_other, every_other) = matrix;
  }
  return both;
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
