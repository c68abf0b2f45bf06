#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>

#include "tests/validation/validation_table.h"
#include "tests/worker/solver/analytic/analytic_waves.h"
#include "tests/worker/solver/reference/chain_probe.h"
#include "tests/worker/solver/reference/from_eliminated.h"
#include "worker/solver/reference/generalized_alpha.h"
#include "worker/solver/reference/motion.h"
#include "worker/solver/reference/pefrl.h"

namespace oblique::validation {
namespace {

using solver::BeamEndOnSpring;
using solver::Chain;
using solver::ChainState;
using solver::ModelParameters;
using solver::Motion;
using solver::RodEndOnSpring;

/// The speed is so small that the response of the elements is linear.
constexpr double kV0_m_s = 1e-3;
constexpr double kSpring_N_m = 2.6e7;

ModelParameters link(double length_m, int elements) {
  ModelParameters model = solver::preset("paper");
  model.lengths_m = {length_m};
  model.elements_per_link = elements;
  model.g_m_s2 = 1e-12;
  model.A_m2 = 5e-4;
  model.I_m4 = 2e-8;
  return model;
}

/// Returns a horizontal link that rotates about its pin. The tip, where waves start, moves down at
/// V0.
ChainState turning(const Chain& chain, double length_m) {
  ChainState state = chain.at_rest();
  state.v.row(1) = -kV0_m_s / length_m * state.q.row(0);
  return state;
}

/// Returns a link that hangs straight down. All nodes except the pin move down at V0. A wave starts
/// at the pin with the speed of sound.
ChainState falling_along(const Chain& chain, const ModelParameters& model) {
  ChainState state = chain.at_rest();
  state.q.row(1) = -state.q.row(0);
  state.q.row(0).setZero();
  for (const Eigen::Index row : solver::position_rows(model)) {
    state.v(1, row) = row == 0 ? 0.0 : -kV0_m_s;
  }
  return state;
}

/// Returns the largest difference between the contact force and `right`, divided by `scale_N`.
double force_error(const Motion& motion, const solver::AffineContactForce<double>& force,
                   ChainState state, double dt_s, double duration_s, double scale_N,
                   const std::function<double(double)>& right) {
  ChainState next = state;
  double largest = 0.0;
  motion.restart(force, state);
  for (double t_s = dt_s; t_s < duration_s; t_s += dt_s) {
    motion.step(state, force, dt_s, next);
    std::swap(state, next);
    const double missing_N = force.fn_N(motion.tip(state).y_m) - right(t_s);
    largest = std::max(largest, std::abs(missing_N) / scale_N);
  }
  return largest;
}

struct BeamErrors {
  double explicit_way;
  double generalized_alpha;
};

BeamErrors beam_errors(int elements) {
  constexpr double kLength_m = 0.4;
  // The peak is at 57.8 us; reflections from the pin arrive from 85 us on.
  constexpr double kWindow_s = 85e-6;
  const ModelParameters model = link(kLength_m, elements);
  const Chain chain(model);
  const solver::GeneralizedAlphaMotion constrained(model);
  const BeamEndOnSpring beam(model.rho_kg_m3 * model.A_m2, model.E_Pa * model.I_m4, kSpring_N_m,
                             kV0_m_s);
  solver::AffineContactForce<double> spring;
  spring.k_nn = kSpring_N_m;
  const auto right = [&](double t_s) { return beam.force_N(t_s); };
  const ChainState start = turning(chain, kLength_m);
  return {force_error(solver::ExplicitMotion(chain), spring, start, 0.1e-6, kWindow_s,
                      beam.peak_N(), right),
          force_error(constrained, spring, from_eliminated(constrained.chain(), start), 0.1e-6,
                      kWindow_s, beam.peak_N(), right)};
}

TEST(Waves, BeamTipOnASpringHasTheForceOfASemiInfiniteBeam) {
  struct Known {
    int elements;
    double bound;
  };
  const std::string reference = "Mittag-Leffler solution, semi-infinite Euler beam";
  for (const Known& known : {Known{4, 0.0415}, Known{8, 0.00505}, Known{16, 0.000315}}) {
    const BeamErrors errors = beam_errors(known.elements);
    const std::string what =
        "beam tip on a spring, n = " + std::to_string(known.elements) + ": force, of its peak, ";
    const std::string reason = "known error of this mesh, to its last digit";
    expect_at_most({what + "explicit", reference, errors.explicit_way, known.bound, reason});
    expect_at_most(
        {what + "generalized-alpha", reference, errors.generalized_alpha, known.bound, reason});
  }
}

/// Returns a rod so long that the wave from the pin does not reach the tip. The rod has almost no
/// bending stiffness. The paper's curvature includes r'' along the beam, so bending stiffness would
/// stiffen short axial waves.
ModelParameters rod_of(int elements) {
  ModelParameters model = link(0.8, elements);
  model.I_m4 = 1e-16;
  return model;
}

struct Rod {
  Rod(int elements, double spring_N_m) : model(rod_of(elements)), chain(model) {
    spring.k_nn = spring_N_m;
    spring.y0 = -model.lengths_m.front();
    dt_s = std::min(
        0.1e-6, 0.2 * solver::Pefrl::stability_limit() / chain.highest_frequency_rad_s(spring_N_m));
  }
  RodEndOnSpring exact() const {
    return {model.E_Pa, model.A_m2, model.rho_kg_m3, spring.k_nn, kV0_m_s};
  }
  double window_s() const { return 0.8 * model.lengths_m.front() / exact().wave_speed_m_s(); }

  ModelParameters model = solver::preset("paper");
  Chain chain;
  solver::AffineContactForce<double> spring;
  double dt_s;
};

TEST(Waves, RodOnASpringHasTheForceOfASemiInfiniteRod) {
  const auto error = [](int elements) {
    const Rod rod(elements, kSpring_N_m);
    const RodEndOnSpring exact = rod.exact();
    return force_error(solver::ExplicitMotion(rod.chain), rod.spring,
                       falling_along(rod.chain, rod.model), rod.dt_s, rod.window_s(),
                       exact.force_without_spring_N(),
                       [&](double t_s) { return exact.force_N(t_s); });
  };
  const std::string reference = "rho A c V0 (1 - exp(-k t/(rho A c)))";
  const double coarse = error(32);
  const double fine = error(64);
  expect_at_most({"rod on a spring, n = 64: force, of rho A c V0", reference, fine, 2e-4,
                  "the front's first element: k h/(rho A c^2)/60"});
  expect_at_least({"rod on a spring: error at n = 32, of that at 64", reference, coarse / fine, 2.0,
                   "F has a kink at the front: order 1 at least"});
}

TEST(Waves, RodOnARigidWallHasTheForceOfASemiInfiniteRod) {
  // The rod is nearly rigid: the spring compresses for 0.07 us.
  const Rod rod(64, 1e11);
  const solver::ExplicitMotion motion(rod.chain);
  ChainState state = falling_along(rod.chain, rod.model);
  ChainState next = state;
  double impulse_Ns = 0.0;
  while (state.t_s < rod.window_s()) {
    impulse_Ns += motion.step(state, rod.spring, rod.dt_s, next).impulse_n;
    std::swap(state, next);
  }
  const double mean_N = impulse_Ns / state.t_s;
  const double right_N = rod.exact().force_without_spring_N();
  expect_at_most({"rod on a wall, n = 64: mean force until 0.8 L/c", "rho A c V0",
                  std::abs(mean_N / right_N - 1.0), 5e-3,
                  "the force rings with the elements: a quarter of one's passage in 51"});
}

}  // namespace
}  // namespace oblique::validation
