#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/solver/cases/shared_fingers.h"

/// What one expects of an impact before any number is known.
namespace oblique::solver {
namespace {

TEST(Impact, TipOfAVeryHeavyMassBouncesAsThatMassAlone) {
  constexpr double kMass_kg = 100.0;
  ModelParameters model = coarse_model();
  model.tip_mass_kg = kMass_kg;
  const CaseResult result = Finger{model}.solve(0.3, 0.0, 1.0);
  // Half a period on the spring. Links of 1.7 kg and gravity add a per cent.
  EXPECT_NEAR(result.duration_s, M_PI * std::sqrt(kMass_kg / model.k_N_m),
              0.03 * result.duration_s);
  EXPECT_NEAR(result.fn_peak_N, -result.vn_in_m_s * std::sqrt(kMass_kg * model.k_N_m),
              0.03 * result.fn_peak_N);
}

TEST(Impact, WithoutFrictionNothingActsAlongTheGround) {
  const CaseResult result = coarse_finger().solve(0.9, 0.0, 0.8);
  EXPECT_EQ(result.impulse_t_Ns, 0.0);
  EXPECT_EQ(result.ft_peak_N, 0.0);
  EXPECT_EQ(result.energy.friction_J, 0.0);
  EXPECT_TRUE(result.stick_intervals.empty());
}

TEST(Impact, WithoutHysteresisNothingIsLostInRestitution) {
  const CaseResult result = coarse_finger().solve(0.9, 0.4, 1.0);
  EXPECT_NEAR(result.energy.restitution_J, 0.0, 1e-9 * result.energy.exchanged_J);
  EXPECT_GT(result.energy.friction_J, 0.0);
}

TEST(Impact, LossInRestitutionIsThatOfEveryCycleBetweenItsTurns) {
  // Up a slope k from F_a to F_b costs (F_b^2 - F_a^2)/2k, down k/e*^2 gives e*^2 of it back.
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

TEST(Impact, FrictionAndNormalWorkAddUpToWhatTheFingerLost) {
  const CaseResult result = paper_finger().solve(1.0, 0.9, 0.7);
  const ContactEnergy& energy = result.energy;
  const double change_J =
      energy.kinetic_change_J + energy.strain_change_J + energy.gravity_change_J;
  EXPECT_NEAR(change_J, -energy.friction_J - energy.restitution_J, 1e-6 * energy.exchanged_J);
  EXPECT_LT(energy.kinetic_change_J, 0.0);
  EXPECT_GT(energy.kinetic_in_J, -energy.kinetic_change_J);
}

}  // namespace
}  // namespace oblique::solver
