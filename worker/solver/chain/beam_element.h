#pragma once

#include <array>

/// The planar two-node ANCF Euler beam element.
///
/// Coordinates of one direction: position p_i, slope s_i = dr/dx, position p_j, slope s_j; cubic
/// Hermite shape functions on a length l. Everything the element stores depends on the gradient
/// r'(x), a quadratic, written here in Legendre polynomials of zeta = 2x/l - 1:
///
///   r' = c0 + c1 P1(zeta) + c2 P2(zeta),
///   c0 = (p_j - p_i)/l,  c1 = (s_j - s_i)/2,  c2 = (s_i + s_j)/2 - c0.
///
/// In these coordinates bending is diagonal, since r'' = (2/l)(c1 + 3 zeta c2).
namespace oblique::solver {

template <class Real>
struct PlanarVector {
  Real x;
  Real y;
};

/// Gradient coefficients (or the forces conjugate to them) of one element.
template <class Real>
struct GradientCoefficients {
  PlanarVector<Real> c[3];
};

/// Five-point Gauss rule on [-1, 1]; exact to degree 9, and eps r' P2 has degree 8.
struct GaussRule {
  static constexpr double outer_abscissa = 0.90617984593866399280;
  static constexpr double inner_abscissa = 0.53846931010568309104;
  static constexpr double outer_weight = 0.23692688505618908751;
  static constexpr double inner_weight = 0.47862867049936646804;
  static constexpr double centre_weight = 0.56888888888888888889;
};

constexpr double legendre_p2(double zeta) {
  return 1.5 * zeta * zeta - 0.5;
}

template <class Real>
GradientCoefficients<Real> gradient_coefficients(const PlanarVector<Real>& p_i,
                                                 const PlanarVector<Real>& s_i,
                                                 const PlanarVector<Real>& p_j,
                                                 const PlanarVector<Real>& s_j,
                                                 double inverse_length) {
  GradientCoefficients<Real> g;
  g.c[0] = {(p_j.x - p_i.x) * inverse_length, (p_j.y - p_i.y) * inverse_length};
  g.c[1] = {0.5 * (s_j.x - s_i.x), 0.5 * (s_j.y - s_i.y)};
  g.c[2] = {0.5 * (s_i.x + s_j.x) - g.c[0].x, 0.5 * (s_i.y + s_j.y) - g.c[0].y};
  return g;
}

/// Adds the axial forces of the Gauss points at +-zeta, p2 = P2(zeta), half weight `w` = EA l/2
/// times the Gauss weight. The gradient splits into an even and an odd part, so the pair costs
/// little more than one point.
template <class Real>
inline void add_axial_pair(const GradientCoefficients<Real>& g, double zeta, double p2, double w,
                           GradientCoefficients<Real>& f) {
  const PlanarVector<Real> even{g.c[0].x + p2 * g.c[2].x, g.c[0].y + p2 * g.c[2].y};
  const PlanarVector<Real> odd{zeta * g.c[1].x, zeta * g.c[1].y};
  // eps(+-zeta) = mean +- difference, eps = (r'.r' - 1)/2.
  const Real mean = 0.5 * (even.x * even.x + even.y * even.y + odd.x * odd.x + odd.y * odd.y) - 0.5;
  const Real difference = even.x * odd.x + even.y * odd.y;
  const Real weighted_mean = (2.0 * w) * mean;
  const Real weighted_difference = (2.0 * w) * difference;
  const PlanarVector<Real> even_force{weighted_mean * even.x + weighted_difference * odd.x,
                                      weighted_mean * even.y + weighted_difference * odd.y};
  const PlanarVector<Real> odd_force{weighted_mean * odd.x + weighted_difference * even.x,
                                     weighted_mean * odd.y + weighted_difference * even.y};
  f.c[0].x += even_force.x;
  f.c[0].y += even_force.y;
  f.c[1].x += zeta * odd_force.x;
  f.c[1].y += zeta * odd_force.y;
  f.c[2].x += p2 * even_force.x;
  f.c[2].y += p2 * even_force.y;
}

/// dU/dc of one element, U = 1/2 int (EA eps^2 + EI kappa^2) dx with the Green strain
/// eps = (r'.r' - 1)/2 and kappa^2 = r''.r'' (paper, eqs. 7 and 8 as corrected).
/// half_EA_length = EA l/2 [N m]; bending = 2 EI/l [N m].
template <class Real>
GradientCoefficients<Real> elastic_gradient(const GradientCoefficients<Real>& g,
                                            double half_EA_length, double bending) {
  GradientCoefficients<Real> f;
  const PlanarVector<Real> centre{g.c[0].x - 0.5 * g.c[2].x, g.c[0].y - 0.5 * g.c[2].y};
  const Real strain = 0.5 * (centre.x * centre.x + centre.y * centre.y) - 0.5;
  const Real tension = (half_EA_length * GaussRule::centre_weight) * strain;
  f.c[0] = {tension * centre.x, tension * centre.y};
  // int kappa^2 dx = (4/l)(c1.c1 + 3 c2.c2), so dU/dc1 = 2 bending c1 and dU/dc2 = 6 bending c2.
  f.c[1] = {(2.0 * bending) * g.c[1].x, (2.0 * bending) * g.c[1].y};
  f.c[2] = {(6.0 * bending) * g.c[2].x - 0.5 * f.c[0].x,
            (6.0 * bending) * g.c[2].y - 0.5 * f.c[0].y};
  constexpr double inner_p2 = legendre_p2(GaussRule::inner_abscissa);
  constexpr double outer_p2 = legendre_p2(GaussRule::outer_abscissa);
  add_axial_pair(g, GaussRule::inner_abscissa, inner_p2, half_EA_length * GaussRule::inner_weight,
                 f);
  add_axial_pair(g, GaussRule::outer_abscissa, outer_p2, half_EA_length * GaussRule::outer_weight,
                 f);
  return f;
}

/// Strain energy of one element [J]; same arguments as `elastic_gradient`.
double strain_energy(const GradientCoefficients<double>& g, double half_EA_length, double bending);

/// Mass matrix of one direction, int rho A s_a s_b dx (paper, eq. 6), rows p_i, s_i, p_j, s_j.
std::array<std::array<double, 4>, 4> mass_matrix(double mass_per_length, double length);

/// int s_a'' s_b'' dx (paper, eq. 10 without EI).
std::array<std::array<double, 4>, 4> bending_matrix(double length);

/// int s_a' s_b' dx: the axial stiffness of the straight element without EA.
std::array<std::array<double, 4>, 4> gradient_matrix(double length);

/// int s_a dx: what a uniform load of 1 N/m puts on the coordinates of its direction.
std::array<double, 4> uniform_load(double length);

}  // namespace oblique::solver
