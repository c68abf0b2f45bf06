#pragma once

#include <Eigen/Core>

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

/// Coordinates of one element: p_i, s_i, p_j, s_j side by side, x above y.
using ElementCoordinates = Eigen::Matrix<double, 2, 4>;

/// c0, c1, c2 of one element side by side, or the forces dU/dc conjugate to them.
using GradientCoefficients = Eigen::Matrix<double, 2, 3>;

/// B in C = Q Bᵀ: a row a coefficient, a column a coordinate. dU/dQ is then (dU/dC) B.
using GradientMap = Eigen::Matrix<double, 3, 4>;

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

GradientMap gradient_map(double inverse_length);

/// C = Q Bᵀ by differences: a rigid shift is gone before anything is rounded.
GradientCoefficients gradient_coefficients(const ElementCoordinates& q, double inverse_length);

/// dU/dC of one element, U = 1/2 int (EA eps^2 + EI kappa^2) dx with the Green strain
/// eps = (r'.r' - 1)/2 and kappa^2 = r''.r'' (paper, eqs. 7 and 8 as corrected).
/// half_EA_length = EA l/2 [N m]; bending = 2 EI/l [N m].
GradientCoefficients elastic_gradient(const GradientCoefficients& c, double half_EA_length,
                                      double bending);

/// Strain energy of one element [J]; same arguments as `elastic_gradient`.
double strain_energy(const GradientCoefficients& c, double half_EA_length, double bending);

/// Mass matrix of one direction, int rho A s_a s_b dx (paper, eq. 6), rows p_i, s_i, p_j, s_j.
Eigen::Matrix4d mass_matrix(double mass_per_length, double length);

/// int s_a'' s_b'' dx (paper, eq. 10 without EI).
Eigen::Matrix4d bending_matrix(double length);

/// int s_a' s_b' dx: the axial stiffness of the straight element without EA.
Eigen::Matrix4d gradient_matrix(double length);

/// int s_a dx: what a uniform load of 1 N/m puts on the coordinates of its direction.
Eigen::Vector4d uniform_load(double length);

}  // namespace oblique::solver
