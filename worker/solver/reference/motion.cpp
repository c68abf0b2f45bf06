#include "worker/solver/reference/motion.h"

#include "worker/solver/reference/pefrl.h"

namespace oblique::solver {
namespace {

/// The map of q'' = -q over one step h is stable while |trace| <= 2.
constexpr bool is_stable(double h) {
  double half_trace = 0.0;
  for (int column = 0; column < 2; ++column) {
    double q = column == 0 ? 1.0 : 0.0;
    double v = column == 0 ? 0.0 : 1.0;
    for (std::size_t i = 0; i < Pefrl::kKicks; ++i) {
      q += Pefrl::drift[i] * h * v;
      v -= Pefrl::kick[i] * h * q;
    }
    q += Pefrl::drift[Pefrl::kKicks] * h * v;
    half_trace += 0.5 * (column == 0 ? q : v);
  }
  return half_trace <= 1.0 && half_trace >= -1.0;
}

constexpr double longest_stable() {
  double stable = 1.0;
  while (is_stable(stable + 0.01)) {
    stable += 0.01;
  }
  double unstable = stable + 0.01;
  while (unstable - stable > 1e-12) {
    const double middle = 0.5 * (stable + unstable);
    (is_stable(middle) ? stable : unstable) = middle;
  }
  return stable;
}

}  // namespace

double Pefrl::stability_limit() {
  constexpr double kLimit = longest_stable();  // found by the compiler: points ask for it often
  return kLimit;
}

Energies ExplicitMotion::energies(const ChainState& state) const {
  return {chain_.kinetic_energy_J(state.v), chain_.strain_energy_J(state.q),
          chain_.gravity_energy_J(state.q)};
}

ContactIntegrals<double> ExplicitMotion::step(const ChainState& from,
                                              const AffineContactForce<double>& force, double h_s,
                                              ChainState& to) const {
  to.t_s = from.t_s + h_s;
  to.q.resizeLike(from.q);
  to.v.resizeLike(from.v);
  to.room.vectors.resizeLike(from.q);
  return pefrl_step(chain_.tables(), force, h_s, from.q.data(), from.v.data(), to.q.data(),
                    to.v.data(), to.room.vectors.data());
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
