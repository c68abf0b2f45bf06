#include "worker/solver/chain/beam_tangent.h"

namespace oblique::solver {

ElementTangent in_both_directions(const Eigen::Matrix4d& matrix) {
  ElementTangent both = ElementTangent::Zero();
  for (int direction = 0; direction < 2; ++direction) {
    const auto every_other = Eigen::seqN(direction, Eigen::fix<4>, Eigen::fix<2>);
    both(every_other, every_other) = matrix;
  }
  return both;
}

ElementTangent elastic_tangent(const GradientCoefficients& c, const GradientMap& map,
                               double half_EA_length, double bending) {
  constexpr double outer = GaussRule::outer_abscissa;
  constexpr double inner = GaussRule::inner_abscissa;
  // Legendre polynomials at the five points, a column a point.
  const Eigen::Matrix<double, 3, 5> P{
      {1.0, 1.0, 1.0, 1.0, 1.0},
      {-outer, -inner, 0.0, inner, outer},
      {legendre_p2(outer), legendre_p2(inner), -0.5, legendre_p2(inner), legendre_p2(outer)}};
  using FiveValues = Eigen::Vector<double, 5>;
  const FiveValues w =
      half_EA_length * FiveValues{GaussRule::outer_weight, GaussRule::inner_weight,
                                  GaussRule::centre_weight, GaussRule::inner_weight,
                                  GaussRule::outer_weight};
  const Eigen::Matrix<double, 2, 5> R = c * P;                // r'
  const Eigen::Matrix<double, 4, 5> S = map.transpose() * P;  // the shape functions' derivatives
  const FiveValues strain = 0.5 * (R.colwise().squaredNorm().array() - 1.0).transpose();
  Eigen::Matrix<double, 8, 5> G;  // S'ᵀ r' = d eps/dq
  for (Eigen::Index a = 0; a < 4; ++a) {
    G.middleRows<2>(2 * a) = R * S.row(a).asDiagonal();
  }
  // Bending is diagonal in c.
  const Eigen::Vector3d by_c(0.0, 2.0 * bending, 6.0 * bending);
  const Eigen::Matrix4d alike = S * w.cwiseProduct(strain).asDiagonal() * S.transpose() +
                                map.transpose() * by_c.asDiagonal() * map;
  const Eigen::Matrix<double, 8, 5> weighted = G * w.asDiagonal();
  return weighted.lazyProduct(G.transpose()) + in_both_directions(alike);
}

}  // namespace oblique::solver
