#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "tests/worker/solver/analytic/analytic_rigid_impact.h"
#include "tests/worker/solver/analytic/analytic_waves.h"

namespace oblique::solver {
namespace {

TEST(MittagLeffler, HasKnownValuesAndDerivative) {
  EXPECT_DOUBLE_EQ(mittag_leffler_three_halves(2.0, 0.0), 1.0);
  // The derivative of t E_{3/2,2}(-t^{3/2}) with respect to t is E_{3/2,1}(-t^{3/2}).
  const auto f = [](double t) { return t * mittag_leffler_three_halves(2.0, -std::pow(t, 1.5)); };
  for (const double t : {0.5, 1.0, 2.0, 4.0}) {
    EXPECT_NEAR((f(t + 1e-4) - f(t - 1e-4)) / 2e-4,
                mittag_leffler_three_halves(1.0, -std::pow(t, 1.5)), 1e-8);
  }
}

TEST(BeamEndOnSpring, HasTheKnownPeak) {
  const BeamEndOnSpring beam(2700.0 * 5e-4, 70e9 * 2e-8, 2.6e7, 1.0);
  EXPECT_NEAR(beam.peak_N(), 784.05, 0.005);
  EXPECT_NEAR(beam.peak_time_s(), 57.8e-6, 0.05e-6);
}

TEST(BeamEndOnSpring, SatisfiesItsIntegralEquation) {
  const BeamEndOnSpring beam(1.35, 1400.0, 2.6e7, 1.0);
  const double C = std::sqrt(2.0) / (std::pow(1.35, 0.75) * std::pow(1400.0, 0.25));
  // Computes the half integral of F at t. With s = t - u^2 the integrand has no singularity.
  constexpr int kIntervals = 1000;
  for (const double t : {10e-6, 50e-6, 90e-6}) {
    double sum = 0.0;
    for (int i = 0; i < kIntervals; ++i) {
      const double u = std::sqrt(t) * (i + 0.5) / kIntervals;
      sum += beam.force_N(t - u * u);
    }
    const double half_integral = 2.0 / std::sqrt(M_PI) * sum * std::sqrt(t) / kIntervals;
    EXPECT_NEAR(beam.force_rate_N_s(t), 2.6e7 * (1.0 - C * half_integral), 2.6e7 * 1e-6);
  }
}

TEST(RodEndOnSpring, HasTheKnownImpedanceAndTendsToTheForceOnAWall) {
  const RodEndOnSpring rod(70e9, 5e-4, 2700.0, 2.7e7, 2.0);
  EXPECT_NEAR(rod.wave_speed_m_s(), 5091.75, 0.005);
  EXPECT_NEAR(rod.impedance_Ns_m(), 6873.9, 0.05);
  EXPECT_NEAR(rod.force_N(1e-9), 2.7e7 * 2.0 * 1e-9, 1e-6);
  EXPECT_NEAR(rod.force_N(1.0), rod.force_without_spring_N(), 1e-9);
}

RigidImpact::Parameters impact(double W_tt, double W_tn, double W_nn) {
  RigidImpact::Parameters p;
  p.W_per_kg << W_tt, W_tn, W_tn, W_nn;
  p.k_N_m = 1e6;
  p.eta2 = 1.21;
  p.mu = 0.3;
  p.e_star = 0.7;
  p.V0_m_s = {2.0, -1.0};
  return p;
}

TEST(RigidImpact, BallThatSlidesThroughoutIsABilinearOscillator) {
  // The body is a free particle: W is 1/m, without coupling.
  const RigidImpact ball(impact(0.5, 0.0, 0.5));
  const double omega = std::sqrt(1e6 * 0.5);
  EXPECT_EQ(ball.mode(), "sC sR");
  EXPECT_NEAR(ball.duration_s(), 0.5 * M_PI / omega * (1.0 + 0.7), 1e-15);
  EXPECT_NEAR(ball.fn_peaks_N().at(0), 1e6 / omega, 1e-8);
  EXPECT_NEAR(ball.velocity_out_m_s()[1], 0.7, 1e-12);
  EXPECT_NEAR(ball.velocity_out_m_s()[0], 2.0 - 0.3 * 1.7, 1e-12);
}

}  // namespace
}  // namespace oblique::solver
