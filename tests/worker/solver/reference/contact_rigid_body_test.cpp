#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/worker/solver/analytic/analytic_rigid_impact.h"
#include "tests/worker/solver/reference/rigid_tip_motion.h"
#include "worker/solver/reference/solve_contact.h"

/// Compares the contact of a rigid body with its closed form.
namespace oblique::solver {
namespace {

constexpr double k_N_m = 1e6;

/// Time in which 1 kg on the spring of compression oscillates by one radian.
const double radian_s = 1.0 / std::sqrt(k_N_m);

RigidImpact::Parameters impact(double W_tt, double W_tn, double W_nn, double mu, double e_star,
                               double vt_m_s, double vn_m_s, double eta2 = 1.2) {
  RigidImpact::Parameters p;
  p.W_per_kg << W_tt, W_tn, W_tn, W_nn;
  p.k_N_m = k_N_m;
  p.eta2 = eta2;
  p.mu = mu;
  p.e_star = e_star;
  p.V0_m_s = {vt_m_s, vn_m_s};
  return p;
}

CaseResult solved(const RigidImpact::Parameters& p, double step_radians = 2e-3,
                  const Tracing::Sink& trace = {}) {
  const RigidTipMotion motion(p.W_per_kg);
  const double dt_s = step_radians * radian_s;
  // Oscillations in restitution are 1/e* times faster.
  return solve_contact(motion, {p.k_N_m, p.eta2, p.mu, p.e_star}, {dt_s, dt_s * p.e_star},
                       motion.moving(p.V0_m_s), {trace, false});
}

double stick_s(const CaseResult& result) {
  double sum = 0.0;
  for (const StickInterval& interval : result.stick_intervals) {
    sum += interval.t1_s - interval.t0_s;
  }
  return sum;
}

/// Returns the local maxima of |F_t| in the closed form, found by sampling.
std::vector<double> tangential_maxima_N(const RigidImpact& exact) {
  constexpr int kSamples = 5000;
  std::vector<double> maxima_N;
  double before_N = 0.0;
  double here_N = 0.0;
  for (int i = 1; i <= kSamples; ++i) {
    const double next_N = std::abs(exact.force_N(exact.duration_s() * i / kSamples)[0]);
    if (here_N > before_N && here_N >= next_N) {
      maxima_N.push_back(here_N);
    }
    before_N = here_N;
    here_N = next_N;
  }
  return maxima_N;
}

/// Compares a contact with the closed form. The integrator's order is 4, so with a step of 2e-3 rad
/// the errors are 1e-11.
void expect_closed_form(const RigidImpact::Parameters& p, double tolerance = 1e-9) {
  const RigidImpact exact(p);
  const CaseResult result = solved(p);
  const double force_N = std::sqrt(k_N_m) * p.V0_m_s.norm();
  EXPECT_EQ(result.mode, exact.mode());
  EXPECT_NEAR(result.duration_s, exact.duration_s(), tolerance * radian_s);
  EXPECT_NEAR(result.vt_out_m_s, exact.velocity_out_m_s()[0], tolerance * p.V0_m_s.norm());
  EXPECT_NEAR(result.vn_out_m_s, exact.velocity_out_m_s()[1], tolerance * p.V0_m_s.norm());
  EXPECT_NEAR(result.slide_m, exact.slide_m(), tolerance * p.V0_m_s.norm() * radian_s);
  EXPECT_NEAR(result.stick_total_s, exact.stick_s(), tolerance * radian_s);
  EXPECT_NEAR(stick_s(result), exact.stick_s(), tolerance * radian_s);
  ASSERT_EQ(result.peaks.size(), exact.fn_peaks_N().size());
  for (std::size_t i = 0; i < result.peaks.size(); ++i) {
    EXPECT_NEAR(result.peaks[i].fn_N, exact.fn_peaks_N()[i], tolerance * force_N);
  }
  const std::vector<double> maxima_N = tangential_maxima_N(exact);
  ASSERT_EQ(result.ft_peaks.size(), maxima_N.size());
  for (std::size_t i = 0; i < maxima_N.size(); ++i) {
    // Sampling locates kinks of F_t only to a 5000th of the duration.
    EXPECT_NEAR(result.ft_peaks[i].ft_N, maxima_N[i], 2e-3 * force_N);
  }
  const Eigen::Vector2d impulse = p.W_per_kg.inverse() * (exact.velocity_out_m_s() - p.V0_m_s);
  EXPECT_NEAR(result.impulse_t_Ns, impulse[0], tolerance * impulse.norm());
  EXPECT_NEAR(result.impulse_n_Ns, impulse[1], tolerance * impulse.norm());
  EXPECT_LT(result.energy.closure, tolerance);
}

TEST(ContactOfARigidBody, AgreesWithTheClosedFormForRandomBodies) {
  std::mt19937_64 generator(3);
  const auto uniform = [&generator](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator);
  };
  for (int i = 0; i < 200; ++i) {
    const double W_tt = uniform(0.5, 4.0);
    const double W_nn = uniform(0.5, 4.0);
    const double W_tn = uniform(-0.9, 0.9) * std::sqrt(W_tt * W_nn);
    const double mu = uniform(0.02, 1.5);
    const double e_star = uniform(0.1, 1.0);
    const double vt_m_s = uniform(-3.0, 3.0);
    const double vn_m_s = uniform(-1.0, -0.3);
    SCOPED_TRACE(i);
    expect_closed_form(impact(W_tt, W_tn, W_nn, mu, e_star, vt_m_s, vn_m_s, uniform(0.5, 2.5)));
  }
}

TEST(ContactOfARigidBody, SlidingStopsSticksAndReverses) {
  // The tangential spring reverses the slip before separation.
  const auto p = impact(3.5, 0.0, 1.0, 0.5, 0.7, 1.0, -1.0);
  std::vector<double> directions;
  solved(p, 2e-3, [&directions](const TraceRow& row) {
    if (row.state[0] == 's' && std::abs(row.vP_m_s) > 1e-6) {
      const double sign = row.vP_m_s > 0.0 ? 1.0 : -1.0;
      if (directions.empty() || directions.back() != sign) {
        directions.push_back(sign);
      }
    }
  });
  EXPECT_EQ(directions, (std::vector<double>{1.0, -1.0}));
}

TEST(ContactOfARigidBody, EventLocationKeepsTheOrder) {
  const auto error = [](const RigidImpact::Parameters& p, double step_radians) {
    const RigidImpact exact(p);
    const CaseResult result = solved(p, step_radians);
    const Eigen::Vector2d V(result.vt_out_m_s, result.vn_out_m_s);
    return (V - exact.velocity_out_m_s()).norm() +
           std::abs(result.duration_s - exact.duration_s()) / radian_s;
  };
  for (const auto& p :
       {impact(1.5, 0.4, 1.0, 0.3, 0.6, -2.0, -1.0), impact(3.5, 0.0, 1.0, 0.5, 0.7, 1.0, -1.0)}) {
    // Halving the step divides the error by about 16. The exact factor depends on where events are
    // within steps.
    EXPECT_GT(error(p, 0.2) / error(p, 0.05), 11.3 * 11.3);
    EXPECT_GT(error(p, 0.1) / error(p, 0.025), 11.3 * 11.3);
  }
}

TEST(ContactOfARigidBody, ABallWithEqualStiffnessesSticksUntilSeparationOnTheFrictionCone) {
  // F_n and F_t reach zero together. So separation coincides with the start of slip in both
  // directions. Separation ends the contact before slip begins.
  const auto p = impact(1.0, 0.0, 1.0, 2.0, 1.0, 0.5, -1.0, 1.0);
  const CaseResult result = solved(p);
  EXPECT_EQ(result.mode, "SC SR");
  EXPECT_NEAR(result.duration_s, M_PI * radian_s, 1e-9 * radian_s);
  EXPECT_NEAR(result.vt_out_m_s, -0.5, 1e-9);
  EXPECT_NEAR(result.vn_out_m_s, 1.0, 1e-9);
  // The extremum of F_t coincides with the end of compression and counts as a peak.
  ASSERT_EQ(result.ft_peaks.size(), 1U);
  EXPECT_NEAR(result.ft_peaks[0].ft_N, 0.5 * std::sqrt(k_N_m), 1e-6);
}

TEST(ContactOfARigidBody, ATurnAtTheEndOfSlidingComesFirstAndSlidingMayContinue) {
  // V_t and V_n reach zero together. In restitution the relaxing tangential spring keeps P sliding
  // if eta2/e*^2 > W_tt/W_nn; otherwise P sticks.
  const CaseResult driven = solved(impact(1.5, 0.0, 1.0, 0.4, 0.8, 0.6, -1.0));
  EXPECT_EQ(driven.mode, "sC sR");
  EXPECT_NEAR(driven.vt_out_m_s, 0.6 - 0.4 * 1.5 * 1.8, 1e-9);
  const CaseResult resting = solved(impact(1.5, 0.0, 1.0, 0.4, 1.0, 0.6, -1.0));
  EXPECT_GT(resting.stick_total_s, radian_s);
  // Rounding may change the sign of V_n several times within 1e-13 s. This gives ripples without
  // height.
  EXPECT_EQ(std::count_if(resting.peaks.begin(), resting.peaks.end(),
                          [](const Peak& peak) { return peak.major; }),
            1);
}

TEST(ContactOfARigidBody, CoincidingEventsGiveTheLimitOfSuccessiveEvents) {
  for (const double e_star : {0.8, 1.0}) {
    const CaseResult at_once = solved(impact(1.5, 0.0, 1.0, 0.4, e_star, 0.6, -1.0));
    for (const double shift_m_s : {-1e-7, 1e-7}) {
      const CaseResult apart = solved(impact(1.5, 0.0, 1.0, 0.4, e_star, 0.6 + shift_m_s, -1.0));
      EXPECT_NEAR(at_once.vt_out_m_s, apart.vt_out_m_s, 1e-5);
      EXPECT_NEAR(at_once.duration_s, apart.duration_s, 1e-5 * radian_s);
    }
  }
}

TEST(ContactOfARigidBody, WithoutFrictionPFollowsTheTip) {
  // Coupling pulls the tip back. So P slides forwards, reverses and slides backwards.
  const auto p = impact(1.5, -0.8, 1.0, 0.0, 1.0, 0.5, -1.0);
  const CaseResult result = solved(p);
  EXPECT_EQ(result.mode, "sC sR");
  EXPECT_EQ(result.stick_total_s, 0.0);
  EXPECT_EQ(result.ft_peak_N, 0.0);
  EXPECT_TRUE(result.ft_peaks.empty());
  EXPECT_EQ(result.impulse_t_Ns, 0.0);
  // V_t = 0.5 - 0.8 (1 - cos(w t)) is zero at cos(w t) = 0.375.
  const double z = std::acos(0.375);
  const auto x_m = [](double radians) {
    return radian_s * (0.5 * radians - 0.8 * (radians - std::sin(radians)));
  };
  EXPECT_NEAR(result.slide_m, x_m(z) + (x_m(z) - x_m(M_PI)), 1e-9 * radian_s);
}

TEST(ContactOfARigidBody, AVerticalImpactCausesNoTangentialMotion) {
  for (const double mu : {0.0, 0.7}) {
    const CaseResult result = solved(impact(1.0, 0.0, 1.0, mu, 0.5, 0.0, -1.0));
    EXPECT_EQ(result.mode, mu == 0.0 ? "sC sR" : "SC SR");
    EXPECT_EQ(result.slide_m, 0.0);
    EXPECT_EQ(result.ft_peak_N, 0.0);
    EXPECT_NEAR(result.vn_out_m_s, 0.5, 1e-9);
  }
}

}  // namespace
}  // namespace oblique::solver
