#pragma once

#include <cstddef>

#include "worker/solver/reference/chain_kernel.h"
#include "worker/solver/reference/tip.h"

/// PEFRL, the position-extended Forest-Ruth-like splitting of Omelyan, Mryglod and Folk (Comput.
/// Phys. Commun. 146, 2002, 188): explicit, symplectic, time-reversible, order 4, four force
/// evaluations a step. Drifts q += c_i h v and kicks v += d_i h a(q) alternate.
namespace oblique::solver {

struct Pefrl {
  static constexpr double xi = 0.1786178958448091;
  static constexpr double lambda = -0.2123418310626054;
  static constexpr double chi = -0.06626458266981849;
  static constexpr double drift[]{xi, chi, 1.0 - 2.0 * (chi + xi), chi, xi};
  static constexpr double kick[]{0.5 - lambda, lambda, lambda, 0.5 - lambda};

  static constexpr std::size_t kKicks = 4;

  /// Largest stable omega h for a harmonic oscillator, at which the trace of the step's map is -2.
  static constexpr double stability_limit() { return 2.9894495459063712; }
};

template <class Real>
struct UnwatchedStep {
  void start(std::size_t, const PlanarVector<Real>&) {}
  void end(std::size_t, const PlanarVector<Real>&) {}
};

/// Eqs. 13 and 15: steps q and v (2 * chain.rows entries each) by h seconds into q_next and v_next,
/// which may be q and v themselves. `scratch` has the same size. Calls watch.start(row, v) and
/// later watch.end(row, v) with the rates at both ends of the step, for each row from the tip to
/// the row after the pin. The rates are in registers then, so calls cost little.
template <class Constant, class Real, class Watch = UnwatchedStep<Real>>
inline ContactIntegrals<Real> pefrl_step(const ChainTables<Constant>& chain,
                                         const AffineContactForce<Real>& force, const Real& h_s,
                                         const Real* q, const Real* v, Real* q_next, Real* v_next,
                                         Real* scratch, Watch&& watch = {}) {
  const std::size_t tip = 2 * chain.tip_row;
  ContactIntegrals<Real> integrals;
  put_pair(q_next, 0, pair_at(q, 0));  // the pin does not move
  put_pair(v_next, 0, pair_at(v, 0));
  const Real first_drift_s = Pefrl::drift[0] * h_s;
  for (std::size_t i = 2; i < 2 * chain.rows; ++i) {
    q_next[i] = plus_product(q[i], first_drift_s, v[i]);
  }
  for (std::size_t stage = 0; stage < Pefrl::kKicks; ++stage) {
    const Real* v_from = stage == 0 ? v : v_next;
    const Real fn = force.fn_N(q_next[tip + 1]);
    const Real ft = force.ft_N(q_next[tip], q_next[tip + 1]);
    substitute_forces(chain, q_next, ft, fn, scratch);
    const Real kick_s = Pefrl::kick[stage] * h_s;
    const Real drift_s = Pefrl::drift[stage + 1] * h_s;
    const Real vt_before = v_from[tip];
    // Kicks and drifts each row as soon as its acceleration is known.
    const auto sweep = [&](const auto& tell) {
      substitute_accelerations(
          chain, scratch, [&](std::size_t row, const Real& ax, const Real& ay) {
            const Real vx_before = v_from[2 * row];
            const Real vy_before = v_from[2 * row + 1];
            const Real vx = plus_product(vx_before, kick_s, ax);
            const Real vy = plus_product(vy_before, kick_s, ay);
            v_next[2 * row] = vx;
            v_next[2 * row + 1] = vy;
            q_next[2 * row] = plus_product(q_next[2 * row], drift_s, vx);
            q_next[2 * row + 1] = plus_product(q_next[2 * row + 1], drift_s, vy);
            tell(row, vx_before, vy_before, vx, vy);
          });
    };
    if (stage == 0) {
      sweep([&](std::size_t row, const Real& vx, const Real& vy, const Real&, const Real&) {
        watch.start(row, {vx, vy});
      });
    } else if (stage + 1 == Pefrl::kKicks) {
      sweep([&](std::size_t row, const Real&, const Real&, const Real& vx, const Real& vy) {
        watch.end(row, {vx, vy});
      });
    } else {
      sweep([](std::size_t, const Real&, const Real&, const Real&, const Real&) {});
    }
    integrals.impulse_n += kick_s * fn;
    integrals.impulse_t += kick_s * ft;
    integrals.work_t += kick_s * ft * (0.5 * (vt_before + v_next[tip]));
  }
  return integrals;
}

}  // namespace oblique::solver
