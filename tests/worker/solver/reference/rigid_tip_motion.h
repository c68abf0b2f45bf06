#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cstddef>

#include "worker/solver/reference/motion.h"
#include "worker/solver/reference/pefrl.h"

namespace oblique::solver {

/// The simplest motion for a contact: a rigid body with the inverse mass W at its tip, r'' = W
/// (F_t, F_n), integrated by PEFRL.
class RigidTipMotion : public Motion {
 public:
  explicit RigidTipMotion(const Eigen::Matrix2d& W_per_kg)
      : W_per_kg_(W_per_kg), mass_kg_(W_per_kg.inverse()) {}

  ChainState at_rest() const override { return moving({0.0, 0.0}); }
  ChainState moving(const Eigen::Vector2d& V_m_s) const {
    ChainState state;
    state.q = Eigen::Vector2d::Zero();
    state.v = V_m_s;
    return state;
  }
  TipState tip(const ChainState& state) const override {
    return {state.q(0), state.q(1), state.v(0), state.v(1)};
  }
  Energies energies(const ChainState& state) const override {
    const Eigen::Vector2d V = state.v.col(0);
    return {0.5 * V.dot(mass_kg_ * V), 0.0, 0.0};
  }
  ContactIntegrals<double> step(const ChainState& from, const AffineContactForce<double>& force,
                                double h_s, ChainState& to) const override {
    to = from;
    ContactIntegrals<double> integrals;
    for (std::size_t stage = 0; stage < Pefrl::kKicks; ++stage) {
      drift(Pefrl::drift[stage] * h_s, to);
      const double fn = force.fn_N(to.q(1));
      const double ft = force.ft_N(to.q(0), to.q(1));
      const double kick_s = Pefrl::kick[stage] * h_s;
      const double vt_before = to.v(0);
      to.v += kick_s * W_per_kg_ * Eigen::Vector2d(ft, fn);
      integrals.impulse_n += kick_s * fn;
      integrals.impulse_t += kick_s * ft;
      integrals.work_t += kick_s * ft * 0.5 * (vt_before + to.v(0));
    }
    drift(Pefrl::drift[Pefrl::kKicks] * h_s, to);
    return integrals;
  }
  void restart(const AffineContactForce<double>&, ChainState&) const override {}
  Eigen::Vector2d momentum_Ns(const ChainState& state) const override { return mass_kg_ * state.v; }
  Coordinates node_positions_m(const ChainState& state) const override { return state.q; }
  void reactions(const AffineContactForce<double>&, const ChainState&,
                 Eigen::Matrix2Xd& reactions_N) const override {
    reactions_N.resize(2, 0);
  }

 private:
  static void drift(double h_s, ChainState& state) { state.q += h_s * state.v; }

  Eigen::Matrix2d W_per_kg_;
  Eigen::Matrix2d mass_kg_;
};

}  // namespace oblique::solver
