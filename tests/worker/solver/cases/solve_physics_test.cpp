#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/support/amount.h"
#include "tests/worker/solver/cases/shared_fingers.h"

namespace oblique::solver {
namespace {

TEST(Impact, AVeryHeavyTipBouncesLikeItsMassAlone) {
  constexpr double kMass_kg = 100.0;
  ModelParameters model = coarse_model();
  model.tip_mass_kg = kMass_kg;
  const CaseResult result = Finger{model}.solve(0.3, 0.0, 1.0);
  // The contact lasts half a period of the mass on the spring. Gravity and the links change this
  // time by at most one percent.
  EXPECT_NEAR(result.duration_s, M_PI * std::sqrt(kMass_kg / model.k_N_m),
              0.03 * result.duration_s);
  EXPECT_NEAR(result.fn_peak_N, -result.vn_in_m_s * std::sqrt(kMass_kg * model.k_N_m),
              0.03 * result.fn_peak_N);
}

TEST(Impact, WithoutFrictionThereIsNoTangentialForce) {
  const CaseResult result = coarse_finger().solve(0.9, 0.0, 0.8);
  EXPECT_EQ(result.impulse_t_Ns, 0.0);
  EXPECT_EQ(result.ft_peak_N, 0.0);
  EXPECT_EQ(result.energy.friction_J, 0.0);
  EXPECT_TRUE(result.stick_intervals.empty());
}

TEST(Impact, WithoutHysteresisRestitutionLosesNoEnergy) {
  const CaseResult result = coarse_finger().solve(0.9, 0.4, 1.0);
  EXPECT_NEAR(result.energy.restitution_J, 0.0, 1e-9 * result.energy.exchanged_J);
  EXPECT_GT(result.energy.friction_J, 0.0);
}

TEST(Impact, TheLossInRestitutionIsTheSumOverAllCyclesBetweenTurns) {
  // Compression from F_a to F_b on a line of slope k takes the energy (F_b^2 - F_a^2)/2k.
  // Restitution on a line of slope k/e*^2 returns e*^2 times that energy.
  const double e_star = 0.7;
  const CaseResult result = paper_finger().solve(1.0, 0.4, e_star);
  ASSERT_EQ(result.peaks.size(), 3U);
  double loss_J = 0.0;
  double fn_N = 0.0;
  for (const Phase& phase : result.phases) {
    const double work_J =
        (phase.fn_end_N * phase.fn_end_N - fn_N * fn_N) / (2.0 * paper_finger().model().k_N_m);
    loss_J += phase.kind == PhaseKind::kCompression ? work_J : e_star * e_star * work_J;
    fn_N = phase.fn_end_N;
  }
  EXPECT_NEAR(result.energy.restitution_J, loss_J, 1e-9 * result.energy.exchanged_J);
}

TEST(Impact, TheWorkOfBothForcesIsTheEnergyThatTheFingerLost) {
  const CaseResult result = paper_finger().solve(1.0, 0.9, 0.7);
  const ContactEnergy& energy = result.energy;
  const double change_J =
      energy.kinetic_change_J + energy.strain_change_J + energy.gravity_change_J;
  EXPECT_NEAR(change_J, -energy.friction_J - energy.restitution_J, 1e-6 * energy.exchanged_J);
  EXPECT_LT(energy.kinetic_change_J, 0.0);
  EXPECT_GT(energy.kinetic_in_J, -energy.kinetic_change_J);
}

void expect_finite(const CaseResult& r) {
  for (const double value : {r.fall_time_s,
                             r.impact_x_m,
                             r.vt_in_m_s,
                             r.vn_in_m_s,
                             r.duration_s,
                             r.fn_peak_N,
                             r.ft_peak_N,
                             r.impulse_n_Ns,
                             r.impulse_t_Ns,
                             r.slide_m,
                             r.vt_out_m_s,
                             r.vn_out_m_s,
                             r.stick_total_s,
                             r.energy.kinetic_in_J,
                             r.energy.friction_J,
                             r.energy.restitution_J,
                             r.energy.kinetic_change_J,
                             r.energy.strain_change_J,
                             r.energy.gravity_change_J,
                             r.energy.exchanged_J,
                             r.energy.closure,
                             r.solver.dt_s}) {
    EXPECT_TRUE(std::isfinite(value));
  }
}

/// Expects conditions that every contact fulfils.
void expect_physical(const CaseResult& r, double worst_closure) {
  EXPECT_GT(r.duration_s, 0.0);
  EXPECT_GT(r.impulse_n_Ns, 0.0);
  EXPECT_LT(r.vn_in_m_s, 0.0);
  EXPECT_LE(std::abs(r.impulse_t_Ns), r.mu * r.impulse_n_Ns * (1.0 + 1e-9));
  EXPECT_LE(r.ft_peak_N, r.mu * r.fn_peak_N * (1.0 + 1e-9));
  EXPECT_GE(r.slide_m, 0.0);
  EXPECT_GE(r.energy.friction_J, -1e-9 * r.energy.exchanged_J);
  EXPECT_GE(r.energy.restitution_J, -1e-9 * r.energy.exchanged_J);
  EXPECT_GE(r.energy.closure, 0.0);
  EXPECT_LT(r.energy.closure, worst_closure);
}

/// Expects that phases alternate and fill the contact, that peaks are between phases, and that
/// stick is inside the contact.
void expect_in_order(const CaseResult& r) {
  ASSERT_EQ(r.phases.size(), 2 * r.peaks.size());
  double t_s = 0.0;
  for (std::size_t i = 0; i < r.phases.size(); ++i) {
    EXPECT_EQ(r.phases[i].kind, i % 2 == 0 ? PhaseKind::kCompression : PhaseKind::kRestitution);
    EXPECT_EQ(r.phases[i].t0_s, t_s);
    EXPECT_GE(r.phases[i].t1_s, t_s);
    t_s = r.phases[i].t1_s;
    if (i % 2 == 0) {
      EXPECT_EQ(r.peaks[i / 2].t_s, t_s);
      EXPECT_EQ(r.peaks[i / 2].fn_N, r.phases[i].fn_end_N);
      EXPECT_GE(r.peaks[i / 2].fn_N, 0.0);
    }
  }
  EXPECT_EQ(t_s, r.duration_s);
  double stick_end_s = 0.0;
  double stick_s = 0.0;
  for (const StickInterval& stick : r.stick_intervals) {
    EXPECT_GE(stick.t0_s, stick_end_s);
    EXPECT_GE(stick.t1_s, stick.t0_s);
    stick_end_s = stick.t1_s;
    stick_s += stick.t1_s - stick.t0_s;
  }
  EXPECT_LE(stick_end_s, r.duration_s);
  EXPECT_NEAR(stick_s, r.stick_total_s, 1e-15);
  ASSERT_GE(r.mode.size(), 2U);
  EXPECT_EQ(r.mode[1], 'C');
  EXPECT_EQ(r.mode.back(), 'R');
}

/// Returns a random point. In one of six points, one value is extreme. H stays below the largest
/// drop, at which the tip has no speed.
Point random_point(const Finger& finger, std::mt19937_64& generator) {
  const auto uniform = [&generator](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator);
  };
  const double top_m = std::min(
      finger.largest_drop_m(), 0.999999 * [&finger] {
        double length_m = 0.0;
        for (const double link_m : finger.model().lengths_m) {
          length_m += link_m;
        }
        return length_m;
      }());
  Point point{top_m * uniform(0.05, 0.98), uniform(0.0, 2.0), uniform(0.05, 1.0)};
  switch (std::uniform_int_distribution<int>(0, 17)(generator)) {
    case 0:
      point.mu = 0.0;
      break;
    case 1:
      point.e_star = 0.02;
      break;
    case 2:
      point.H_m = top_m * (1.0 - 1e-8);
      break;
    case 3:
      point.H_m = uniform(1e-5, 1e-3);
      break;
    case 4:
      point.mu = uniform(2.0, 50.0);
      break;
    case 5:
      point.e_star = 1.0;
      break;
    default:
      break;
  }
  return point;
}

void sweep(const ModelParameters& model, int points, unsigned seed, double worst_closure = 1e-4) {
  const Finger finger{model};
  std::mt19937_64 generator(seed);
  for (int i = 0; i < points; ++i) {
    const Point point = random_point(finger, generator);
    SCOPED_TRACE("H = " + std::to_string(point.H_m) + ", mu = " + std::to_string(point.mu) +
                 ", e* = " + std::to_string(point.e_star));
    const CaseResult result = finger.solve(point.H_m, point.mu, point.e_star);
    expect_finite(result);
    expect_physical(result, worst_closure);
    expect_in_order(result);
  }
}

TEST(SolveSweep, ResultsAreFinitePhysicalAndOrderedForRandomModels) {
  struct Case {
    int elements_per_link;
    std::vector<double> lengths_m = {0.4, 0.4, 0.4};
    double tip_mass_kg = 0.0;
    double k_N_m = 2.7e7;
    double eta2 = 1.2463;
    int points = 20;
    double worst_closure = 1e-4;
  };
  const Case cases[] = {
      {.elements_per_link = 2, .points = 60},
      {.elements_per_link = 1, .points = 60},
      {.elements_per_link = 3, .lengths_m = {0.8}, .points = 60},
      {.elements_per_link = 1, .lengths_m = {0.3, 0.2, 0.25, 0.15, 0.1}, .points = 40},
      {.elements_per_link = 1, .tip_mass_kg = 0.5, .points = 40},
      {.elements_per_link = 1, .tip_mass_kg = 1e-3},
      {.elements_per_link = 1, .k_N_m = 1e6},
      {.elements_per_link = 1, .k_N_m = 2.7e8},
      // This spring is four hundred times as stiff as the default, so it alone determines the step.
      {.elements_per_link = 1, .k_N_m = 1e10, .worst_closure = 1e-3},
      {.elements_per_link = 1, .eta2 = 5.0},
      {.elements_per_link = 1, .eta2 = 0.3},
  };
  unsigned seed = 0;
  for (const Case& c : cases) {
    ModelParameters model = coarse_model(c.elements_per_link);
    model.lengths_m = c.lengths_m;
    model.tip_mass_kg = c.tip_mass_kg;
    model.k_N_m = c.k_N_m;
    model.eta2 = c.eta2;
    SCOPED_TRACE(++seed);
    sweep(model, c.points, seed, c.worst_closure);
  }
}

TEST(SolveSweep, SlowResultsArePhysicalForManyPointsOfThePaper) {
  sweep(preset("paper"), test::amount(600, 3000), 11);
}

}  // namespace
}  // namespace oblique::solver
