#pragma once

#include <Eigen/Core>

#include "worker/solver/reference/element_force.h"

/// The planar two-node ANCF Euler beam element (eqs. 1 to 12).
///
/// Coordinates q_e of one direction (eq. 2): position p_i, slope s_i = dr/dx, position p_j, slope
/// s_j; r = S q_e with cubic Hermite shape functions on a length l (eqs. 1, 3 and 4). The energy
/// depends on the gradient r'(x), a quadratic, here in Legendre polynomials of zeta = 2x/l - 1:
///
///   r' = c0 + c1 P1(zeta) + c2 P2(zeta),
///   c0 = (p_j - p_i)/l,  c1 = (s_j - s_i)/2,  c2 = (s_i + s_j)/2 - c0.
///
/// In these coordinates bending is diagonal, since r'' = (2/l)(c1 + 3 zeta c2).
namespace oblique::solver {

/// Coordinates of one element: p_i, s_i, p_j, s_j side by side, x above y.
using ElementCoordinates = Eigen::Matrix<double, 2, 4>;

/// c0, c1, c2 of one element side by side.
using GradientCoefficients = Eigen::Matrix<double, 2, 3>;

/// Computes c0, c1 and c2 from differences, so that a rigid shift causes no rounding.
GradientCoefficients gradient_coefficients(const ElementCoordinates& q, double inverse_length);

ElementConstants<double> element_constants(double length_m, double EA_N, double EI_N_m2,
                                           double mass_per_length);

/// Eq. 7 as corrected: strain energy U = 1/2 int (EA eps^2 + EI kappa^2) dx of one element [J],
/// with eps = (r'.r' - 1)/2 and kappa^2 = r''.r'' (eq. 8).
double strain_energy(const ElementCoordinates& q, const ElementConstants<double>& constants);

/// dU/dq (eqs. 9 to 11), by elastic_forces().
ElementCoordinates elastic_gradient(const ElementCoordinates& q,
                                    const ElementConstants<double>& constants);

/// d2U/dq2 in the order p_i, s_i, p_j, s_j, x before y, by element_tangent().
using ElementTangent = Eigen::Matrix<double, 8, 8>;
ElementTangent elastic_tangent(const ElementCoordinates& q,
                               const ElementConstants<double>& constants);

/// Each entry times the 2 x 2 unit matrix.
ElementTangent in_both_directions(const Eigen::Matrix4d& matrix);

/// Eq. 6: mass matrix of one direction, int rho A s_a s_b dx, rows p_i, s_i, p_j, s_j.
Eigen::Matrix4d mass_matrix(double mass_per_length, double length);

/// Eq. 10 without EI: int s_a'' s_b'' dx.
Eigen::Matrix4d bending_matrix(double length);

/// int s_a' s_b' dx: the axial stiffness of the straight element without EA.
Eigen::Matrix4d gradient_matrix(double length);

/// Eq. 12 without the weight: int s_a dx, the generalised force of a uniform load of 1 N/m.
Eigen::Vector4d uniform_load(double length);

}  // namespace oblique::solver
