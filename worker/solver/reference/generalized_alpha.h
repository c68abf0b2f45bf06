#pragma once

#include <Eigen/Core>

#include "worker/solver/reference/constrained_chain.h"
#include "worker/solver/reference/motion.h"

namespace oblique::solver {

/// Parameters of generalized-alpha from the spectral radius xi at infinite frequency (paper, after
/// eq. 28): second order, unconditionally stable for linear problems.
struct GeneralizedAlphaParameters {
  explicit GeneralizedAlphaParameters(double xi)
      : alpha_m((2.0 * xi - 1.0) / (xi + 1.0)),
        alpha_f(xi / (xi + 1.0)),
        beta(0.25 * (1.0 - alpha_m + alpha_f) * (1.0 - alpha_m + alpha_f)),
        gamma(0.5 - alpha_m + alpha_f) {}

  double alpha_m;
  double alpha_f;
  double beta;
  double gamma;
};

/// The index-3 system of ConstrainedChain under generalized-alpha (Arnold and Bruels, Multibody
/// System Dynamics 18, 2007, 185):
///
///   q_{n+1} = q_n + h v_n + h^2 ((1/2 - beta) a_n + beta a_{n+1})          (eq. 26)
///   v_{n+1} = v_n + h ((1 - gamma) a_n + gamma a_{n+1})                    (eq. 27)
///   (1 - alpha_m) a_{n+1} + alpha_m a_n = (1 - alpha_f) q''_{n+1} + alpha_f q''_n   (eq. 28)
///
/// with the equations of motion and Phi = 0 holding at t_{n+1}. Newton's unknowns are a_{n+1} and
/// lambda_{n+1}. The constraints are divided by beta h^2, so that the matrix
/// [c M + beta h^2 K, Phi_qᵀ; Phi_q, 0], c = (1 - alpha_m)/(1 - alpha_f), is regular as h -> 0.
class GeneralizedAlphaMotion : public Motion {
 public:
  /// Newton's method stops when corrections of positions, relative to an element's length, and of
  /// slopes are at most this tolerance. The remaining error is about the square of the tolerance.
  /// Steps in contact take one iteration.
  static constexpr double kNewtonTolerance = 1e-6;
  static constexpr int kMaxIterations = 20;

  explicit GeneralizedAlphaMotion(const ModelParameters& model);

  const ConstrainedChain& chain() const { return chain_; }

  ChainState at_rest() const override;
  TipState tip(const ChainState& state) const override { return chain_.tip(state); }
  Energies energies(const ChainState& state) const override { return chain_.energies(state); }
  /// Throws SolveError when Newton's method does not converge.
  ContactIntegrals<double> step(const ChainState& from, const AffineContactForce<double>& force,
                                double h_s, ChainState& to) const override;
  void restart(const AffineContactForce<double>& force, ChainState& state) const override;
  Eigen::Vector2d momentum_Ns(const ChainState& state) const override {
    return chain_.momentum_Ns(state.v);
  }
  Coordinates node_positions_m(const ChainState& state) const override {
    return chain_.node_positions_m(state.q);
  }
  void reactions(const AffineContactForce<double>&, const ChainState& state,
                 Eigen::Matrix2Xd& reactions_N) const override {
    reactions_N = -state.multipliers_N;
  }

 private:
  /// dq''/da of eq. 28.
  double mass_factor() const { return (1.0 - alpha_.alpha_m) / (1.0 - alpha_.alpha_f); }
  /// Factors [mass_factor M + stiffness_factor K, Phi_qᵀ; Phi_q, 0] at `state`.
  ConstrainedChain::Matrix factored_matrix(const AffineContactForce<double>& force,
                                           double mass_factor, double stiffness_factor,
                                           const ChainState& state) const;
  /// Sets (a_0 - q''_0)/h of the first step after a restart to (alpha_m - alpha_f) q''' with
  ///
  ///   (M + beta h^2/mass_factor K) q''' + Phi_qᵀ lambda' = -K v,   Phi_q q''' = 0.
  ///
  /// The term with h^2 is small where the step resolves the motion. For faster vibrations it keeps
  /// rounding from being multiplied by M^-1 K.
  void find_offset_rate(const AffineContactForce<double>& force, double h_s,
                        ChainState& state) const;
  /// Eqs. 26 to 28 with q''_{n+1} = q''_n. During a step `algorithmic_offset_rate` contains
  /// a_{n+1}.
  void predict(const ChainState& from, const AffineContactForce<double>& force, double h_s,
               ChainState& to) const;
  /// Eq. 15: sets `residual` to M q'' + Phi_qᵀ lambda + dU/dq - Q - F_c and Phi/(beta h^2).
  void evaluate(const AffineContactForce<double>& force, double h_s, const ChainState& state,
                Coordinates& residual) const;
  /// One correction by Newton's method. Returns its size in the norm of kNewtonTolerance.
  double correct(const AffineContactForce<double>& force, double h_s, ChainState& state) const;
  ContactIntegrals<double> integrals(const AffineContactForce<double>& force, double h_s,
                                     const ChainState& from, const ChainState& to) const;

  ConstrainedChain chain_;
  GeneralizedAlphaParameters alpha_;
  /// By row: 1 over the shortest element's length for positions, 1 for slopes.
  Eigen::RowVectorXd inverse_scale_;
};

}  // namespace oblique::solver
