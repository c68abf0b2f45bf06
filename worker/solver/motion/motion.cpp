#include "worker/solver/motion/motion.h"

#include "worker/solver/motion/pefrl.h"

namespace oblique::solver {

Energies ExplicitMotion::energies(const ChainState& state) const {
  return {chain_.kinetic_energy_J(state.v), chain_.strain_energy_J(state.q),
          chain_.gravity_energy_J(state.q)};
}

ContactIntegrals<double> ExplicitMotion::step(const ChainState& from,
                                              const AffineContactForce<double>& force, double h_s,
                                              ChainState& to) const {
  to.t_s = from.t_s + h_s;
  to.q.resize(from.q.size());
  to.v.resize(from.v.size());
  Coordinates scratch(from.q.size());
  return pefrl_step(chain_.tables(), force, h_s, from.q.data(), from.v.data(), to.q.data(),
                    to.v.data(), scratch.data());
}

std::vector<JointReaction> ExplicitMotion::reactions(const AffineContactForce<double>& force,
                                                     const ChainState& state) const {
  const TipState at = chain_.tip(state);
  Coordinates acceleration(state.q.size());
  chain_.accelerations(state.q.data(), force.ft_N(at.x_m, at.y_m), force.fn_N(at.y_m),
                       acceleration.data());
  std::vector<JointReaction> reactions;
  for (std::size_t link = 0; link < chain_.links(); ++link) {
    const auto [x, y] = chain_.inner_end_force(link, state.q, acceleration);
    reactions.push_back({x, y});
  }
  return reactions;
}

}  // namespace oblique::solver
