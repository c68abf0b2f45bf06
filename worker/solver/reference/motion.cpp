#include "worker/solver/reference/motion.h"

#include "worker/solver/reference/pefrl.h"

namespace oblique::solver {

ContactIntegrals<double> ExplicitMotion::step(const ChainState& from,
                                              const AffineContactForce<double>& force, double h_s,
                                              ChainState& to) const {
  to.t_s = from.t_s + h_s;
  to.q.resizeLike(from.q);
  to.v.resizeLike(from.v);
  Coordinates scratch(2, chain_.rows());
  return pefrl_step(chain_.tables(), force, h_s, from.q.data(), from.v.data(), to.q.data(),
                    to.v.data(), scratch.data());
}

void ExplicitMotion::reactions(const AffineContactForce<double>& force, const ChainState& state,
                               Eigen::Matrix2Xd& reactions_N) const {
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

}  // namespace oblique::solver
