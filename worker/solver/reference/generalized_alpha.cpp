#include "worker/solver/reference/generalized_alpha.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::solver {
namespace {

/// F_c at the tip's position r.
Eigen::Vector2d contact_force(const AffineContactForce<double>& force, const Eigen::Vector2d& r) {
  return {force.ft_N(r.x(), r.y()), force.fn_N(r.y())};
}

/// -dF_c/dr.
Eigen::Matrix2d contact_stiffness(const AffineContactForce<double>& force) {
  return Eigen::Matrix2d{{force.k_tt, force.k_tn}, {0.0, force.k_nn}};
}

Eigen::RowVectorXd inverse_scale(const ConstrainedChain& chain, const ModelParameters& model) {
  const double element_length_m =
      *std::min_element(model.lengths_m.begin(), model.lengths_m.end()) / model.elements_per_link;
  Eigen::RowVectorXd scale = Eigen::RowVectorXd::Ones(chain.rows());
  for (std::size_t link = 0; link < chain.links(); ++link) {
    const Eigen::Index first = chain.multiplier_row(link) + 1;
    scale(Eigen::seqN(first, model.elements_per_link + 1, 2)).setConstant(1.0 / element_length_m);
  }
  return scale;
}

}  // namespace

GeneralizedAlphaMotion::GeneralizedAlphaMotion(const ModelParameters& model)
    : chain_(model), alpha_(model.spectral_radius), inverse_scale_(inverse_scale(chain_, model)) {}

ChainState GeneralizedAlphaMotion::at_rest() const {
  ChainState state = chain_.at_rest();
  restart({}, state);
  return state;
}

ConstrainedChain::Matrix GeneralizedAlphaMotion::factored_matrix(
    const AffineContactForce<double>& force, double mass_factor, double stiffness_factor,
    const ChainState& state) const {
  ConstrainedChain::Matrix matrix(static_cast<std::size_t>(2 * chain_.rows()));
  chain_.add_tangent(state.q, mass_factor, stiffness_factor, matrix);
  matrix.add_block(2 * static_cast<std::size_t>(chain_.tip_row()),
                   (stiffness_factor * contact_stiffness(force)).eval());
  if (!matrix.factor()) {
    throw SolveError("the matrix of accelerations and constraint forces is singular");
  }
  return matrix;
}

void GeneralizedAlphaMotion::restart(const AffineContactForce<double>& force,
                                     ChainState& state) const {
  // M q'' + Phi_qᵀ lambda = Q + F_c - dU/dq, Phi_q q'' = 0.
  const Eigen::Index tip = chain_.tip_row();
  Coordinates& unknowns = state.acceleration;
  unknowns.setZero(2, chain_.rows());
  chain_.add_elastic_and_gravity(state.q, unknowns);
  unknowns.col(tip) -= contact_force(force, state.q.col(tip));
  unknowns = -unknowns;
  factored_matrix(force, 1.0, 0.0, state).solve(unknowns.data());
  state.multipliers_N = chain_.take_multipliers(unknowns);
  state.algorithmic_offset_rate.resize(2, 0);
}

void GeneralizedAlphaMotion::find_offset_rate(const AffineContactForce<double>& force, double h_s,
                                              ChainState& state) const {
  const Eigen::Index tip = chain_.tip_row();
  Coordinates& rate = state.algorithmic_offset_rate;
  rate.setZero(2, chain_.rows());
  chain_.add_stiffness_product(state.q, state.v, rate);
  rate.col(tip) += contact_stiffness(force) * state.v.col(tip);
  // a_n stands for q'' at t_n + (alpha_m - alpha_f) h.
  rate *= mass_factor() * (alpha_.alpha_f - alpha_.alpha_m);
  factored_matrix(force, mass_factor(), alpha_.beta * h_s * h_s, state).solve(rate.data());
  chain_.take_multipliers(rate);
}

void GeneralizedAlphaMotion::predict(const ChainState& from,
                                     const AffineContactForce<double>& force, double h_s,
                                     ChainState& to) const {
  const auto& [alpha_m, alpha_f, beta, gamma] = alpha_;
  to = from;
  if (from.algorithmic_offset_rate.size() == 0) {
    find_offset_rate(force, h_s, to);
  }
  to.t_s = from.t_s + h_s;
  Coordinates& a = to.algorithmic_offset_rate;
  const Coordinates a_from = from.acceleration + h_s * a;
  a = (from.acceleration - alpha_m * a_from) / (1.0 - alpha_m);
  to.q += h_s * (from.v + h_s * ((0.5 - beta) * a_from + beta * a));
  to.v += h_s * ((1.0 - gamma) * a_from + gamma * a);
}

void GeneralizedAlphaMotion::evaluate(const AffineContactForce<double>& force, double h_s,
                                      const ChainState& state, Coordinates& residual) const {
  const Eigen::Index tip = chain_.tip_row();
  residual.setZero(2, chain_.rows());
  chain_.add_inertia(state.acceleration, residual);
  chain_.add_elastic_and_gravity(state.q, residual);
  chain_.add_constraint_forces(state.multipliers_N, residual);
  residual.col(tip) -= contact_force(force, state.q.col(tip));
  chain_.set_constraints(state.q, 1.0 / (alpha_.beta * h_s * h_s), residual);
}

double GeneralizedAlphaMotion::correct(const AffineContactForce<double>& force, double h_s,
                                       ChainState& state) const {
  const double by_position = alpha_.beta * h_s * h_s;
  Coordinates correction;  // -(Delta a and Delta lambda)
  evaluate(force, h_s, state, correction);
  factored_matrix(force, mass_factor(), by_position, state).solve(correction.data());
  state.multipliers_N -= chain_.take_multipliers(correction);
  state.algorithmic_offset_rate -= correction;
  state.acceleration -= mass_factor() * correction;
  state.q -= by_position * correction;
  state.v -= alpha_.gamma * h_s * correction;
  return by_position *
         (correction * inverse_scale_.asDiagonal()).cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
}

ContactIntegrals<double> GeneralizedAlphaMotion::step(const ChainState& from,
                                                      const AffineContactForce<double>& force,
                                                      double h_s, ChainState& to) const {
  if (h_s == 0.0) {
    to = from;
    return {};
  }
  predict(from, force, h_s, to);
  for (int iteration = 0;; ++iteration) {
    if (iteration == kMaxIterations) {
      throw SolveError("Newton's method did not converge in " + std::to_string(kMaxIterations) +
                       " iterations at t = " + readable_number(to.t_s) + " s with a step of " +
                       exact_number(h_s) + " s");
    }
    const double moved = correct(force, h_s, to);
    if (moved <= kNewtonTolerance) {
      break;
    }
    if (!std::isfinite(moved)) {
      throw SolveError("a step of " + exact_number(h_s) +
                       " s diverged at t = " + readable_number(to.t_s) + " s");
    }
  }
  to.algorithmic_offset_rate = (to.algorithmic_offset_rate - to.acceleration) / h_s;
  return integrals(force, h_s, from, to);
}

ContactIntegrals<double> GeneralizedAlphaMotion::integrals(const AffineContactForce<double>& force,
                                                           double h_s, const ChainState& from,
                                                           const ChainState& to) const {
  // Hermite rules integrate values and derivatives at both ends, with a higher order than the step.
  struct End {
    Eigen::Vector2d F, F_1, F_2;  // F_c and its derivatives in time
    double P, P_1;                // F_t V_t
  };
  const Eigen::Matrix2d K = contact_stiffness(force);
  const auto at = [&](const ChainState& state) {
    const Eigen::Index tip = chain_.tip_row();
    const auto v = state.v.col(tip);
    const auto a = state.acceleration.col(tip);
    const Eigen::Vector2d F = contact_force(force, state.q.col(tip));
    const Eigen::Vector2d F_1 = -K * v;
    return End{F, F_1, -K * a, F.x() * v.x(), F_1.x() * v.x() + F.x() * a.x()};
  };
  const End e0 = at(from);
  const End e1 = at(to);
  const double h = h_s;
  const Eigen::Vector2d impulse =
      h * (0.5 * (e0.F + e1.F) + h * ((e0.F_1 - e1.F_1) / 10.0 + h / 120.0 * (e0.F_2 + e1.F_2)));
  return {impulse.y(), impulse.x(), h * (0.5 * (e0.P + e1.P) + h / 12.0 * (e0.P_1 - e1.P_1))};
}

}  // namespace oblique::solver
