#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/worker/solver/analytic/analytic_waves.h"
#include "tests/worker/solver/chain/chain_probe.h"
#include "worker/solver/contact/solve_contact.h"
#include "worker/solver/motion/motion.h"
#include "worker/solver/motion/pefrl.h"

/// The tip of a link on the contact spring, against waves in closed form.
namespace oblique::solver {
namespace {

/// Thrown by a trace to end a contact early.
struct SeenEnough {};

/// One link, almost without gravity.
ModelParameters one_link(int elements) {
  ModelParameters model = preset("printed");
  model.lengths_m = {0.4};
  model.elements_per_link = elements;
  model.g_m_s2 = 1e-9;
  return model;
}

/// Follows the contact from `start` up to t_end_s and calls `see` at every accepted instant.
void follow(const Chain& chain, const ContactParameters& parameters, const ChainState& start,
            double t_end_s, const std::function<void(const TraceRow&)>& see) {
  const ExplicitMotion motion(chain);
  const double dt_s =
      0.2 * Pefrl::stability_limit() / chain.highest_frequency_rad_s(parameters.k_N_m);
  const auto trace = [&](const TraceRow& row) {
    if (row.t_s > t_end_s) {
      throw SeenEnough{};
    }
    see(row);
  };
  EXPECT_THROW(solve_contact(motion, parameters, {dt_s, dt_s}, start, {trace, false}), SeenEnough);
}

/// Largest error of the force on the tip of a link of n elements that meets a spring sideways,
/// over its peak. The link turns about its pin, which moves its tip as a translation would, but
/// starts no wave at the pin.
double beam_error(int elements) {
  constexpr double kSpeed_m_s = 1e-3;
  constexpr double k_N_m = 2.6e7;
  const ModelParameters model = one_link(elements);
  const Chain chain(model);
  ChainState start = chain.at_rest();
  start.v.row(1) = -kSpeed_m_s / model.lengths_m[0] * start.q.row(0);
  const BeamEndOnSpring exact(model.rho_kg_m3 * model.A_m2, model.E_Pa * model.I_m4, k_N_m,
                              kSpeed_m_s);
  double largest = 0.0;
  follow(chain, {k_N_m, 1.0, 0.0, 1.0}, start, 1.5 * exact.peak_time_s(), [&](const TraceRow& row) {
    largest = std::max(largest, std::abs(row.fn_N - exact.force_N(row.t_s)));
  });
  return largest / exact.peak_N();
}

TEST(BeamTipOnSpring, IsAsNearTheMittagLefflerSolutionAsTheMeshAllows) {
  // Known: 4.1, 0.50 and 0.031 % of the peak.
  EXPECT_NEAR(beam_error(4), 0.041, 0.002);
  EXPECT_NEAR(beam_error(8), 0.0050, 0.0002);
  EXPECT_NEAR(beam_error(16), 0.00031, 0.00005);
}

/// Largest error of the force on the end of a rod that flies along itself onto a spring, and its
/// last value, over the force on a wall. The link stands on end, its tip below; its other end is
/// held by the pin, whose wave arrives at L/c, so that only the time up to `fraction` of that
/// counts.
struct RodForce {
  double largest_error;
  double last;
};
RodForce rod_force(int elements, double k_N_m, double fraction) {
  constexpr double kSpeed_m_s = 1e-3;
  ModelParameters model = one_link(elements);
  // The curvature of these elements resists a changing stretch too; without it they are a rod.
  model.I_m4 = 1e-14;
  const Chain chain(model);
  ChainState start = chain.at_rest();
  start.q.row(1) = -start.q.row(0);
  start.q.row(0).setZero();
  for (const Eigen::Index row : position_rows(model)) {
    start.v(1, row) = row == 0 ? 0.0 : -kSpeed_m_s;
  }
  const RodEndOnSpring exact(model.E_Pa, model.A_m2, model.rho_kg_m3, k_N_m, kSpeed_m_s);
  const double t_end_s = fraction * model.lengths_m[0] / exact.wave_speed_m_s();
  double largest = 0.0;
  double last_N = 0.0;
  follow(chain, {k_N_m, 1.2, 0.5, 1.0}, start, t_end_s, [&](const TraceRow& row) {
    largest = std::max(largest, std::abs(row.fn_N - exact.force_N(row.t_s)));
    last_N = row.fn_N;
  });
  const double on_a_wall_N = exact.force_without_spring_N();
  return {largest / on_a_wall_N, last_N / on_a_wall_N};
}

TEST(RodOnSpring, ConvergesToTheExponentialUntilAWaveComesBack) {
  const auto error = [](int elements) { return rod_force(elements, 2.7e8, 0.5).largest_error; };
  const double coarse = error(8);
  EXPECT_LT(coarse, 5e-3);
  EXPECT_LT(error(16), coarse / 3.0);
  EXPECT_LT(error(32), coarse / 9.0);
}

TEST(RodOnSpring, OnAHardSpringTheForceIsSoonThatOnAWall) {
  // rho A c/k = 6.4 us, a twelfth of L/c and five times what a wave takes along an element: at
  // L/2c the exponential is at 0.2 %.
  EXPECT_NEAR(rod_force(64, 1.15e9, 0.5).last, 1.0, 0.01);
}

}  // namespace
}  // namespace oblique::solver
