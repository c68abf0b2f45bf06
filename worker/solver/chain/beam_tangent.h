#pragma once

#include <array>

#include "worker/solver/chain/beam_element.h"

namespace oblique::solver {

/// Second derivatives of an element's strain energy in its eight coordinates, in the order p_i,
/// s_i, p_j, s_j, x before y: the exact tangent of `elastic_gradient`.
using ElementTangent = std::array<std::array<double, 8>, 8>;
ElementTangent elastic_tangent(const GradientCoefficients<double>& g, double inverse_length,
                               double half_EA_length, double bending);

/// Coefficients of the gradient by coordinates: c_k = sum_a rows[k][a] (p_i, s_i, p_j, s_j)_a.
std::array<std::array<double, 4>, 3> gradient_map(double inverse_length);

}  // namespace oblique::solver
