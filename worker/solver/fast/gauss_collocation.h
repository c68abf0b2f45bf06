#pragma once

#include <cstddef>

namespace oblique::solver {

/// Coefficients of Gauss collocation with eight stages on [0, 1] (order 16, symplectic, stable on
/// any oscillator). With accelerations a_j at the nodes c_j and a step of h,
///
///   q_i = q + c_i h v + h^2 sum_j (A A)_ij a_j,                at the nodes,
///   v' = v + h sum_j b_j a_j,  q' = q + h v + h^2 sum_j b_j (1 - c_j) a_j   at the end.
///
/// A A = T diag(lambda^2) T^-1 is diagonal in complex numbers. One eigenvalue of each conjugate
/// pair is kept. In this basis a vector consists of real and imaginary parts in turn.
struct GaussCollocation {
  static constexpr std::size_t kStages = 8;  ///< chosen by work and precision (collocation.md)
  static constexpr std::size_t kPairs = kStages / 2;

  GaussCollocation();

  double node[kStages]{};               ///< c_j
  double weight[kStages]{};             ///< b_j
  double position_weight[kStages]{};    ///< b_j (1 - c_j)
  double integral[kStages][kStages]{};  ///< A
  double squared_re[kPairs]{};          ///< lambda^2
  double squared_im[kPairs]{};
  double into[kStages][kStages]{};   ///< T^-1
  double back[kStages][kStages]{};   ///< 2 T, to include the conjugate eigenvalues
  double shift[kStages][kStages]{};  ///< 2 T diag(lambda^2), likewise
  /// Legendre coefficients of the Lagrange polynomials: l_j = sum_k legendre[k][j] P_k(2 c - 1).
  double legendre[kStages][kStages]{};

  /// b_j(c) = int_0^c l_j, l_j the Lagrange polynomials of the nodes.
  void integrals(double c, double* b) const;
};

const GaussCollocation& gauss_collocation();

}  // namespace oblique::solver
