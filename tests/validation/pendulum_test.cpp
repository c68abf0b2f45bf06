#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>

#include "tests/validation/validation_table.h"
#include "tests/worker/solver/reference/from_eliminated.h"
#include "worker/solver/reference/generalized_alpha.h"
#include "worker/solver/reference/motion.h"
#include "worker/solver/reference/pefrl.h"

namespace oblique::validation {
namespace {

using solver::Chain;
using solver::ChainState;
using solver::ModelParameters;
using solver::Motion;

constexpr solver::AffineContactForce<double> kNoContact{};

ModelParameters pendulum() {
  ModelParameters model = solver::preset("paper");
  model.lengths_m = {0.4};
  return model;
}

/// With a thousandth of the stiffness, the swinging link bends and stretches measurably.
ModelParameters soft_pendulum() {
  ModelParameters model = pendulum();
  model.E_Pa *= 1e-3;
  return model;
}

double energy_J(const Motion& motion, const ChainState& state) {
  const solver::Energies energies = motion.energies(state);
  return energies.kinetic_J + energies.strain_J + energies.gravity_J;
}

/// Final state of a run from rest, and the largest change of the energy during the run.
struct Swing {
  ChainState state;
  double energy_drift_J = 0.0;
};

Swing swing(const Motion& motion, double dt_s, int steps) {
  Swing result{motion.at_rest(), 0.0};
  const double start_J = energy_J(motion, result.state);
  ChainState next = result.state;
  for (int i = 0; i < steps; ++i) {
    motion.step(result.state, kNoContact, dt_s, next);
    std::swap(result.state, next);
    result.energy_drift_J =
        std::max(result.energy_drift_J, std::abs(energy_J(motion, result.state) - start_J));
  }
  return result;
}

/// Returns the first time at which `value` is below zero, located by varying the last step.
double first_zero_s(const Motion& motion, ChainState state, double dt_s,
                    const std::function<double(const ChainState&)>& value) {
  ChainState next = state;
  for (;;) {
    motion.step(state, kNoContact, dt_s, next);
    if (value(next) < 0.0) {
      break;
    }
    std::swap(state, next);
  }
  double low = 0.0;
  double high = dt_s;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    motion.step(state, kNoContact, middle, next);
    (value(next) < 0.0 ? high : low) = middle;
  }
  return state.t_s + high;
}

TEST(Pendulum, ConservesItsEnergyWithBothIntegrators) {
  const ModelParameters model = soft_pendulum();
  const Chain chain(model);
  const solver::ExplicitMotion by_explicit(chain);
  const solver::GeneralizedAlphaMotion by_generalized_alpha(model);
  const Swing one = swing(by_explicit, 50e-6, 20'000);
  const Swing other = swing(by_generalized_alpha, 25e-6, 40'000);
  const double weight_N = model.rho_kg_m3 * model.A_m2 * model.lengths_m.front() * model.g_m_s2;
  const double swung_J = 0.5 * weight_N * model.lengths_m.front();
  const std::string reference = "energy at release, of m g L/2";
  expect_at_most({"soft pendulum, 1 s, explicit, 50 us: energy", reference,
                  one.energy_drift_J / swung_J, 1e-10, "symplectic: (w h)^4, no drift"});
  expect_at_most({"soft pendulum, 1 s, generalized-alpha, 25 us: energy", reference,
                  other.energy_drift_J / swung_J, 1e-7,
                  "(w h)^2 of the bending that the swing excites, w h = 0.01"});
  const solver::TipState a = chain.tip(one.state);
  const solver::TipState b = by_generalized_alpha.tip(other.state);
  expect_at_most({"soft pendulum, 1 s, generalized-alpha, 25 us: tip, of L", "explicit, 50 us",
                  std::hypot(a.x_m - b.x_m, a.y_m - b.y_m) / model.lengths_m.front(), 2e-6,
                  "amplitude of the stretching vibration, out of phase by then"});
}

TEST(Pendulum, SwingsLikeARigidPendulumInTheStiffLimit) {
  // A uniform rod released from the horizontal is a pendulum of length 2L/3, amplitude 90 degrees.
  ModelParameters model = pendulum();
  const double quarter_s = std::sqrt(2.0 * model.lengths_m.front() / (3.0 * model.g_m_s2)) *
                           std::comp_ellint_1(std::sqrt(0.5));
  const std::string reference = "sqrt(2L/3g) K(sin 45 deg)";
  for (const double stiffening : {1.0, 16.0}) {
    model.E_Pa = pendulum().E_Pa * stiffening;
    const Chain chain(model);
    const solver::ExplicitMotion by_explicit(chain);
    const solver::GeneralizedAlphaMotion by_generalized_alpha(model);
    const auto error = [&](const Motion& motion, double dt_s) {
      const auto x = [&](const ChainState& state) { return motion.tip(state).x_m; };
      return std::abs(first_zero_s(motion, motion.at_rest(), dt_s, x) / quarter_s - 1.0);
    };
    const double sag_over_L = model.rho_kg_m3 * model.A_m2 * model.g_m_s2 *
                              std::pow(model.lengths_m.front(), 3) /
                              (8.0 * model.E_Pa * model.I_m4);
    const std::string what =
        "pendulum, E * " + std::to_string(std::lround(stiffening)) + ", quarter period, ";
    const std::string reason = "a tenth of the sag of the pendulum as a cantilever, relative to L";
    expect_at_most({what + "explicit", reference,
                    error(by_explicit, 0.5 * solver::Pefrl::stability_limit() /
                                           chain.highest_frequency_rad_s(0.0)),
                    0.1 * sag_over_L, reason});
    expect_at_most({what + "generalized-alpha, 20 us", reference,
                    error(by_generalized_alpha, 20e-6), 0.1 * sag_over_L, reason});
  }
}

/// Returns half the period of the first bending vibration of a beam with a pinned and a free end:
/// the time at which the modal coordinate phi^T M q returns to zero. Other modes are orthogonal to
/// phi.
double half_period_s(const Motion& motion, const ChainState& start, double dt_s) {
  const auto product = [&](const ChainState& state) {
    // Computes a^T M b up to a factor, as T(a + b) - T(a - b) with the kinetic energy T. a is the
    // transverse displacement, b the mode.
    ChainState sum = start;
    ChainState difference = start;
    // The link lies along x, so transverse positions and slopes are zero at rest.
    sum.v.row(1) = state.q.row(1) + start.v.row(1);
    difference.v.row(1) = state.q.row(1) - start.v.row(1);
    return motion.energies(sum).kinetic_J - motion.energies(difference).kinetic_J;
  };
  return first_zero_s(motion, start, dt_s, product);
}

TEST(Pendulum, VibratesAtTheFirstFrequencyOfAPinnedFreeBeam) {
  constexpr double kRoot = 3.92660231204791879;  // root of tan z = tanh z
  for (const int elements : {4, 8, 16}) {
    ModelParameters model = pendulum();
    model.g_m_s2 = 1e-12;
    model.elements_per_link = elements;
    const double length_m = model.lengths_m.front();
    const double frequency_rad_s =
        kRoot * kRoot / (length_m * length_m) *
        std::sqrt(model.E_Pa * model.I_m4 / (model.rho_kg_m3 * model.A_m2));
    const Chain chain(model);
    ChainState start = chain.at_rest();
    constexpr double kSpeed_m_s = 1e-4;  // a speed so low that the vibration is linear
    for (Eigen::Index row = 0; row < chain.rows(); ++row) {
      const double z = kRoot * static_cast<double>(row / 2) / elements;
      const bool is_slope = row % 2 == 1;
      start.v(1, row) =
          kSpeed_m_s * (is_slope
                            ? kRoot / length_m *
                                  (std::cos(z) / std::sin(kRoot) + std::cosh(z) / std::sinh(kRoot))
                            : std::sin(z) / std::sin(kRoot) + std::sinh(z) / std::sinh(kRoot));
    }
    const solver::ExplicitMotion by_explicit(chain);
    const solver::GeneralizedAlphaMotion by_generalized_alpha(model);
    ChainState constrained = from_eliminated(by_generalized_alpha.chain(), start);
    by_generalized_alpha.restart(kNoContact, constrained);
    const double right_s = M_PI / frequency_rad_s;
    // The error of the step, at most (w h)^2/12, is far below the error of the elements.
    const double dt_s =
        std::min(1e-6, 0.2 * solver::Pefrl::stability_limit() / chain.highest_frequency_rad_s(0.0));
    const double element = std::pow(kRoot / elements, 4) / 1440.0;
    const std::string what =
        "pinned-free beam, n = " + std::to_string(elements) + ", first bending frequency, ";
    const std::string reference = "tan z = tanh z, Euler beam";
    const std::string reason = "(z/n)^4/1440 of cubic elements with their own mass";
    expect_at_most({what + "explicit", reference,
                    std::abs(half_period_s(by_explicit, start, dt_s) / right_s - 1.0), element,
                    reason});
    expect_at_most(
        {what + "generalized-alpha", reference,
         std::abs(half_period_s(by_generalized_alpha, constrained, dt_s) / right_s - 1.0), element,
         reason});
  }
}

}  // namespace
}  // namespace oblique::validation
