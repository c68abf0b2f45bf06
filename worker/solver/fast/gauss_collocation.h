#pragma once

#include <cstddef>

namespace oblique::solver {

/// Gauss collocation with eight stages (order 16, symplectic, stable on any oscillator) on [0, 1]:
/// its coefficients. With accelerations a_j at the nodes c_j and a step of h,
///
///   q_i = q + c_i h v + h^2 sum_j (A A)_ij a_j,                at the nodes,
///   v' = v + h sum_j b_j a_j,  q' = q + h v + h^2 sum_j b_j (1 - c_j) a_j   at the end.
///
/// A A is diagonalised, A A = T diag(lambda^2) T^-1, in conjugate pairs.
struct GaussCollocation {
  static constexpr std::size_t kStages = 8;  ///< chosen by work and precision (collocation.md)
  static constexpr std::size_t kPairs = kStages / 2;

  GaussCollocation();

  double node[kStages]{};
  double weight[kStages]{};             ///< b_j
  double position_weight[kStages]{};    ///< b_j (1 - c_j)
  double integral[kStages][kStages]{};  ///< A
  double squared_re[kPairs]{};          ///< lambda^2
  double squared_im[kPairs]{};
  double into_re[kPairs][kStages]{};  ///< T^-1
  double into_im[kPairs][kStages]{};
  double back_re[kStages][kPairs]{};  ///< a_i = sum_k back_re z_re + back_im z_im: 2 Re(T z)
  double back_im[kStages][kPairs]{};
  double shift_re[kStages][kPairs]{};  ///< the same of A A a: 2 Re(T lambda^2 z)
  double shift_im[kStages][kPairs]{};
  /// Legendre coefficients of the Lagrange polynomials: l_j = sum_k legendre[k][j] P_k(2 c - 1).
  double legendre[kStages][kStages]{};

  /// b_j(c) = int_0^c l_j, l_j the Lagrange polynomials of the nodes.
  void integrals(double c, double* b) const;
};

/// The coefficients, computed once.
const GaussCollocation& gauss_collocation();

}  // namespace oblique::solver
