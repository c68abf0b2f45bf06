#pragma once

#include <Eigen/Core>

#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/pefrl.h"
#include "worker/solver/reference/tip.h"

namespace oblique::solver {

/// An integrator with its equations of motion. Immutable; may be used by several threads at once. A
/// ChainState is valid only for the Motion that made it.
class Motion {
 public:
  virtual ~Motion() = default;

  virtual ChainState at_rest() const = 0;
  virtual TipState tip(const ChainState& state) const = 0;
  virtual Energies energies(const ChainState& state) const = 0;

  /// Steps from `from` to `to` by h_s >= 0 seconds under `force`. Returns the integrals of `force`.
  virtual ContactIntegrals<double> step(const ChainState& from,
                                        const AffineContactForce<double>& force, double h_s,
                                        ChainState& to) const = 0;

  /// Recomputes accelerations and multipliers for a new `force`.
  virtual void restart(const AffineContactForce<double>& force, ChainState& state) const = 0;

  /// Linear momentum of the whole chain [N s].
  virtual Eigen::Vector2d momentum_Ns(const ChainState& state) const = 0;
  /// Positions of the nodes, one per column, O first and the tip last.
  virtual Coordinates node_positions_m(const ChainState& state) const = 0;

  /// Forces on the outer link at O and at each joint, one per column, from O outwards.
  virtual void reactions(const AffineContactForce<double>& force, const ChainState& state,
                         Eigen::Matrix2Xd& reactions_N) const = 0;
};

/// The chain with joints eliminated, stepped by PEFRL.
class ExplicitMotion : public Motion {
 public:
  /// `chain` must outlive this.
  explicit ExplicitMotion(const Chain& chain) : chain_(chain) {}

  ChainState at_rest() const override { return chain_.at_rest(); }
  TipState tip(const ChainState& state) const override { return chain_.tip(state); }
  Energies energies(const ChainState& state) const override { return chain_.energies(state); }
  ContactIntegrals<double> step(const ChainState& from, const AffineContactForce<double>& force,
                                double h_s, ChainState& to) const override {
    to.t_s = from.t_s + h_s;
    to.q.resizeLike(from.q);
    to.v.resizeLike(from.v);
    Coordinates scratch(2, chain_.rows());
    return pefrl_step(chain_.tables(), force, h_s, from.q.data(), from.v.data(), to.q.data(),
                      to.v.data(), scratch.data());
  }
  void restart(const AffineContactForce<double>&, ChainState&) const override {}
  Eigen::Vector2d momentum_Ns(const ChainState& state) const override {
    return chain_.momentum_Ns(state.v);
  }
  Coordinates node_positions_m(const ChainState& state) const override {
    return chain_.node_positions_m(state.q);
  }
  void reactions(const AffineContactForce<double>& force, const ChainState& state,
                 Eigen::Matrix2Xd& reactions_N) const override {
    const TipState at = chain_.tip(state);
    Coordinates acceleration(2, chain_.rows());
    chain_.accelerations(state.q.data(), force.ft_N(at.x_m, at.y_m), force.fn_N(at.y_m),
                         acceleration.data());
    reactions_N.resize(2, static_cast<Eigen::Index>(chain_.links()));
    for (std::size_t link = 0; link < chain_.links(); ++link) {
      reactions_N.col(static_cast<Eigen::Index>(link)) =
          chain_.inner_end_force(link, state.q, acceleration);
    }
  }

 private:
  const Chain& chain_;
};

}  // namespace oblique::solver
