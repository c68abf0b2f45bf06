#pragma once

#include <cstddef>

namespace oblique::solver {

/// Gauss collocation with six stages (order 12, symplectic, stable on any oscillator) on [0, 1],
/// and what its solution takes. With accelerations a_j at the nodes c_j and a step of h,
///
///   q_i = q + c_i h v + h^2 sum_j (A A)_ij a_j,                at the nodes,
///   v' = v + h sum_j b_j a_j,  q' = q + h v + h^2 sum_j b_j (1 - c_j) a_j   at the end.
///
/// A A is diagonalised, A A = T diag(lambda^2) T^-1, in conjugate pairs; for odd s one
/// lambda is real and counts as a pair that is its own conjugate.
struct GaussCollocation {
  static constexpr std::size_t kMostStages = 8;
  static constexpr std::size_t kMostPairs = kMostStages / 2;
  static constexpr std::size_t pairs_of(std::size_t stages) { return (stages + 1) / 2; }

  /// 2 to kMostStages stages.
  explicit GaussCollocation(std::size_t stages);

  std::size_t stages;

  double node[kMostStages];
  double weight[kMostStages];                 ///< b_j
  double position_weight[kMostStages];        ///< b_j (1 - c_j)
  double integral[kMostStages][kMostStages];  ///< A
  double squared_re[kMostPairs];              ///< lambda^2
  double squared_im[kMostPairs];
  double into_re[kMostPairs][kMostStages];  ///< T^-1
  double into_im[kMostPairs][kMostStages];
  double back_re[kMostStages][kMostPairs];  ///< a_i = sum_k back_re z_re + back_im z_im: 2 Re(T z)
  double back_im[kMostStages][kMostPairs];
  double shift_re[kMostStages][kMostPairs];  ///< the same of A A a: 2 Re(T lambda^2 z)
  double shift_im[kMostStages][kMostPairs];
  /// The two highest Legendre coefficients of the accelerations over the step.
  double highest[2][kMostStages];
  /// Legendre coefficients of the Lagrange polynomials: l_j = sum_k legendre[k][j] P_k(2 c - 1).
  double legendre[kMostStages][kMostStages];

  /// b_j(c) = int_0^c l_j, l_j the Lagrange polynomials of the nodes.
  void integrals(double c, double* b) const;
};

}  // namespace oblique::solver
