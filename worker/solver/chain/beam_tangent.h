#pragma once

#include "worker/solver/chain/beam_element.h"

namespace oblique::solver {

/// Second derivatives of an element's strain energy in its eight coordinates, in the order p_i,
/// s_i, p_j, s_j, x before y: the exact tangent of `elastic_gradient`,
///
///   K = EA int (S'ᵀr')(S'ᵀr')ᵀ + eps S'ᵀS' dx + EI int S''ᵀS'' dx,
///
/// with S' the 2x8 matrix of the shape functions' derivatives.
using ElementTangent = Eigen::Matrix<double, 8, 8>;
ElementTangent elastic_tangent(const GradientCoefficients& c, const GradientMap& map,
                               double half_EA_length, double bending);

/// A matrix of one direction as one of both: each entry times the unit matrix of x and y.
ElementTangent in_both_directions(const Eigen::Matrix4d& matrix);

}  // namespace oblique::solver
