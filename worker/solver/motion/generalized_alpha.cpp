#include "worker/solver/motion/generalized_alpha.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::solver {

GeneralizedAlphaMotion::GeneralizedAlphaMotion(const ModelParameters& model)
    : chain_(model),
      alpha_(model.spectral_radius),
      element_length_m_(*std::min_element(model.lengths_m.begin(), model.lengths_m.end()) /
                        model.elements_per_link) {}

ChainState GeneralizedAlphaMotion::at_rest() const {
  ChainState state = chain_.at_rest();
  restart({}, state);
  return state;
}

Energies GeneralizedAlphaMotion::energies(const ChainState& state) const {
  return {chain_.kinetic_energy_J(state.v), chain_.strain_energy_J(state.q),
          chain_.gravity_energy_J(state.q)};
}

void GeneralizedAlphaMotion::restart(const AffineContactForce<double>& force,
                                     ChainState& state) const {
  const std::size_t tip = chain_.tip_index();
  const std::size_t size = chain_.size();
  ConstrainedChain::Matrix matrix(size);
  matrix.set_zero();
  chain_.add_tangent(state.q, 1.0, 0.0, matrix);
  if (!matrix.factor()) {
    throw SolveError("the constraints of this chain are not independent");
  }
  // M q'' + Phiᵀ lambda = Q + F_c - dU/dq, Phi q'' = 0.
  std::vector<double> unknowns(size, 0.0);
  chain_.add_elastic_and_gravity(state.q, unknowns);
  unknowns[tip] -= force.ft_N(state.q[tip], state.q[tip + 1]);
  unknowns[tip + 1] -= force.fn_N(state.q[tip + 1]);
  for (double& value : unknowns) {
    value = -value;
  }
  matrix.solve(unknowns);
  state.multipliers_N.resize(2 * chain_.links());
  for (std::size_t link = 0; link < chain_.links(); ++link) {
    for (std::size_t c = 0; c < 2; ++c) {
      const std::size_t index = chain_.multiplier_index(link) + c;
      state.multipliers_N[2 * link + c] = unknowns[index];
      unknowns[index] = 0.0;
    }
  }
  state.acceleration = std::move(unknowns);
  state.algorithmic_offset_rate.clear();
}

double GeneralizedAlphaMotion::mass_factor() const {
  return (1.0 - alpha_.alpha_m) / (1.0 - alpha_.alpha_f);
}

void GeneralizedAlphaMotion::add_newton_matrix(const Coordinates& q,
                                               const AffineContactForce<double>& force, double h_s,
                                               ConstrainedChain::Matrix& matrix) const {
  const std::size_t tip = chain_.tip_index();
  const double stiffness_factor = alpha_.beta * h_s * h_s;
  chain_.add_tangent(q, mass_factor(), stiffness_factor, matrix);
  matrix.add(tip, tip, stiffness_factor * force.k_tt);
  matrix.add(tip, tip + 1, stiffness_factor * force.k_tn);
  matrix.add(tip + 1, tip + 1, stiffness_factor * force.k_nn);
}

Coordinates GeneralizedAlphaMotion::starting_offset_rate(const ChainState& from,
                                                         const AffineContactForce<double>& force,
                                                         double h_s) const {
  const std::size_t tip = chain_.tip_index();
  ConstrainedChain::Matrix matrix(chain_.size());
  matrix.set_zero();
  add_newton_matrix(from.q, force, h_s, matrix);
  if (!matrix.factor()) {
    throw SolveError("the Newton matrix is singular");
  }
  Coordinates rates(chain_.size(), 0.0);
  chain_.add_stiffness_product(from.q, from.v, rates);
  rates[tip] += force.k_tn * from.v[tip + 1] + force.k_tt * from.v[tip];
  rates[tip + 1] += force.k_nn * from.v[tip + 1];
  // a_n stands for q'' at t_n + (alpha_m - alpha_f) h.
  const double factor = mass_factor() * (alpha_.alpha_f - alpha_.alpha_m);
  for (double& rate : rates) {
    rate *= factor;
  }
  matrix.solve(rates);
  for (std::size_t link = 0; link < chain_.links(); ++link) {
    rates[chain_.multiplier_index(link)] = 0.0;
    rates[chain_.multiplier_index(link) + 1] = 0.0;
  }
  return rates;
}

void GeneralizedAlphaMotion::predict(const ChainState& from,
                                     const AffineContactForce<double>& force, double h_s,
                                     ChainState& to) const {
  to = from;
  if (from.algorithmic_offset_rate.empty()) {
    to.algorithmic_offset_rate = starting_offset_rate(from, force, h_s);
  }
  to.t_s = from.t_s + h_s;
  // q''_{n+1} = q''_n to begin with.
  for (std::size_t i = 0; i < chain_.size(); ++i) {
    const double a_from = from.acceleration[i] + h_s * to.algorithmic_offset_rate[i];
    const double a_to = (from.acceleration[i] - alpha_.alpha_m * a_from) / (1.0 - alpha_.alpha_m);
    to.q[i] += h_s * (from.v[i] + h_s * ((0.5 - alpha_.beta) * a_from + alpha_.beta * a_to));
    to.v[i] += h_s * ((1.0 - alpha_.gamma) * a_from + alpha_.gamma * a_to);
    // Held as a_{n+1} until the step is done.
    to.algorithmic_offset_rate[i] = a_to;
  }
}

void GeneralizedAlphaMotion::evaluate(const AffineContactForce<double>& force, double h_s,
                                      const ChainState& state,
                                      std::vector<double>& residual) const {
  const std::size_t tip = chain_.tip_index();
  std::fill(residual.begin(), residual.end(), 0.0);
  chain_.add_inertia(state.acceleration, residual);
  chain_.add_elastic_and_gravity(state.q, residual);
  chain_.add_constraint_forces(state.multipliers_N, residual);
  residual[tip] -= force.ft_N(state.q[tip], state.q[tip + 1]);
  residual[tip + 1] -= force.fn_N(state.q[tip + 1]);
  chain_.set_constraints(state.q, 1.0 / (alpha_.beta * h_s * h_s), residual);
}

double GeneralizedAlphaMotion::correct(double h_s, const std::vector<double>& correction,
                                       ChainState& state) const {
  const double q_factor = alpha_.beta * h_s * h_s;
  const double v_factor = alpha_.gamma * h_s;
  const double acceleration_factor = mass_factor();
  double largest = 0.0;
  for (std::size_t link = 0; link < chain_.links(); ++link) {
    const std::size_t multiplier = chain_.multiplier_index(link);
    state.multipliers_N[2 * link] -= correction[multiplier];
    state.multipliers_N[2 * link + 1] -= correction[multiplier + 1];
    const std::size_t end =
        link + 1 < chain_.links() ? chain_.multiplier_index(link + 1) : chain_.size();
    for (std::size_t i = multiplier + 2; i < end; ++i) {
      state.algorithmic_offset_rate[i] -= correction[i];
      state.acceleration[i] -= acceleration_factor * correction[i];
      state.q[i] -= q_factor * correction[i];
      state.v[i] -= v_factor * correction[i];
      const bool is_position = (i - multiplier - 2) % 4 < 2;
      const double moved = std::abs(q_factor * correction[i]);
      largest = std::max(largest, is_position ? moved / element_length_m_ : moved);
    }
  }
  return largest;
}

ContactIntegrals<double> GeneralizedAlphaMotion::step(const ChainState& from,
                                                      const AffineContactForce<double>& force,
                                                      double h_s, ChainState& to) const {
  if (h_s == 0.0) {
    to = from;
    return {};
  }
  predict(from, force, h_s, to);
  ConstrainedChain::Matrix matrix(chain_.size());
  std::vector<double> residual(chain_.size());
  for (int iteration = 0;; ++iteration) {
    if (iteration == kMostIterations) {
      throw SolveError("Newton's method did not converge in " + std::to_string(kMostIterations) +
                       " iterations at t = " + readable_number(to.t_s) + " s with a step of " +
                       exact_number(h_s) + " s");
    }
    evaluate(force, h_s, to, residual);
    matrix.set_zero();
    add_newton_matrix(to.q, force, h_s, matrix);
    if (!matrix.factor()) {
      throw SolveError("the Newton matrix is singular");
    }
    matrix.solve(residual);
    const double moved = correct(h_s, residual, to);
    if (moved <= kNewtonTolerance) {
      break;
    }
    if (!std::isfinite(moved)) {
      throw SolveError("a step of " + exact_number(h_s) +
                       " s diverged at t = " + readable_number(to.t_s) + " s");
    }
  }
  for (std::size_t i = 0; i < chain_.size(); ++i) {
    to.algorithmic_offset_rate[i] = (to.algorithmic_offset_rate[i] - to.acceleration[i]) / h_s;
  }
  return integrals(force, h_s, from, to);
}

ContactIntegrals<double> GeneralizedAlphaMotion::integrals(const AffineContactForce<double>& force,
                                                           double h_s, const ChainState& from,
                                                           const ChainState& to) const {
  // Hermite rules on values and derivatives at both ends: of higher order than the step.
  struct End {
    double fn, fn_1, fn_2, ft, ft_1, ft_2, power, power_1;
  };
  const auto at = [&](const ChainState& state) {
    const std::size_t tip = chain_.tip_index();
    const TipState p = chain_.tip(state);
    const double ax = state.acceleration[tip];
    const double ay = state.acceleration[tip + 1];
    End end{};
    end.fn = force.fn_N(p.y_m);
    end.fn_1 = -force.k_nn * p.vy_m_s;
    end.fn_2 = -force.k_nn * ay;
    end.ft = force.ft_N(p.x_m, p.y_m);
    end.ft_1 = -force.k_tn * p.vy_m_s - force.k_tt * p.vx_m_s;
    end.ft_2 = -force.k_tn * ay - force.k_tt * ax;
    end.power = end.ft * p.vx_m_s;
    end.power_1 = end.ft_1 * p.vx_m_s + end.ft * ax;
    return end;
  };
  const End e0 = at(from);
  const End e1 = at(to);
  const double h = h_s;
  const auto hermite = [h](double f0, double f1, double d0, double d1, double s0, double s1) {
    return h * (0.5 * (f0 + f1) + h * ((d0 - d1) / 10.0 + h * (s0 + s1) / 120.0));
  };
  return {hermite(e0.fn, e1.fn, e0.fn_1, e1.fn_1, e0.fn_2, e1.fn_2),
          hermite(e0.ft, e1.ft, e0.ft_1, e1.ft_1, e0.ft_2, e1.ft_2),
          h * (0.5 * (e0.power + e1.power) + h * (e0.power_1 - e1.power_1) / 12.0)};
}

std::vector<JointReaction> GeneralizedAlphaMotion::reactions(const AffineContactForce<double>&,
                                                             const ChainState& state) const {
  std::vector<JointReaction> reactions;
  for (std::size_t link = 0; link < chain_.links(); ++link) {
    reactions.push_back({-state.multipliers_N[2 * link], -state.multipliers_N[2 * link + 1]});
  }
  return reactions;
}

}  // namespace oblique::solver
