#include "worker/solver/falls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "tests/support/amount.h"
#include "tests/worker/solver/cases/same_bits.h"
#include "tests/worker/solver/cases/shared_fingers.h"

namespace oblique::solver {
namespace {

using testing::HasSubstr;

/// Returns models that differ only in parameters on which the fall does not depend.
std::vector<ModelParameters> models_of_one_fall() {
  std::vector<ModelParameters> models(5, coarse_model());
  models[1].k_N_m = 1.3e7;
  models[2].eta2 = 2.0;
  models[2].tolerance = 1e-4;
  models[3].dt_s = 1e-6;
  models[4].k_N_m = 5e7;
  models[4].eta2 = 0.8;
  return models;
}

TEST(Falls, AreEqualForModelsThatDifferInContactOnly) {
  for (const ModelParameters& model : models_of_one_fall()) {
    EXPECT_EQ(fall_model(model), coarse_model());
  }
}

TEST(Falls, DifferForModelsWithDifferentChainsOrSteps) {
  ModelParameters model = coarse_model();
  model.spectral_radius = 0.5;
  EXPECT_EQ(fall_model(model), coarse_model()) << "the explicit integrator has no spectral radius";
  model.integrator = Integrator::kGeneralizedAlpha;
  EXPECT_EQ(fall_model(model), model);
  for (const ParameterKey& key : model_keys()) {
    if (key.name == "k" || key.name == "eta2" || key.name == "dt" ||
        key.name == "spectral_radius" || key.name == "tolerance") {
      continue;
    }
    ModelParameters other = coarse_model();
    key.set(other, key.name == "integrator" ? 1.0 : 2.0 * key.get(other) + 1.0);
    EXPECT_NE(fall_model(other), coarse_model()) << key.name;
  }
  ModelParameters tighter = coarse_model();
  tighter.tolerance *= 0.5;
  EXPECT_EQ(fall_model(tighter), tighter);
}

TEST(Falls, ReportTheirProgress) {
  ModelParameters other = coarse_model();
  other.E_Pa *= 2.0;
  ModelParameters implicit = coarse_model();
  implicit.integrator = Integrator::kGeneralizedAlpha;
  std::vector<std::shared_ptr<FallenChain>> chains;
  for (const ModelParameters& model : {coarse_model(), other, implicit}) {
    chains.push_back(std::make_shared<FallenChain>(model));
    EXPECT_EQ(chains.back()->fall_progress(), 0.0);
  }
  const auto outcomes = solve_falls(chains);
  for (std::size_t i = 0; i < chains.size(); ++i) {
    const double turn_m = outcomes[i].fallen->fall().largest_drop_m();
    // Progress is reported at intervals, so the last report may be slightly below the largest drop.
    EXPECT_NEAR(chains[i]->fall_progress(), turn_m, 0.02 * turn_m) << i;
    EXPECT_EQ(Finger(chains[i]->model(), chains[i]).drop_so_far_m(), chains[i]->fall_progress());
  }
}

TEST(Falls, SolvedTogetherAreEqualToFallsSolvedAlone) {
  std::vector<ModelParameters> models(6);
  for (std::size_t i = 0; i < models.size(); ++i) {
    // Fine meshes use collocation; coarse meshes and models with dt_fall use explicit steps.
    models[i].elements_per_link = i % 2 == 0 ? test::amount(6, 8) : test::amount(7, 9);
    models[i].E_Pa *= 1.0 + 0.1 * static_cast<double>(i);
  }
  models[2] = coarse_model();
  models[3].elements_per_link = 4;
  models[3].dt_fall_s = 2e-6;
  const std::vector<FallOutcome> together = solve_falls(models);
  for (std::size_t i = 0; i < models.size(); ++i) {
    SCOPED_TRACE(i);
    const FallOutcome alone = solve_falls({&models[i], 1}).front();
    ASSERT_EQ(together[i].error, "");
    const Fall& fall = together[i].fallen->fall();
    const double drop_m = 0.7 * fall.largest_drop_m();
    EXPECT_EQ(fall.largest_drop_m(), alone.fallen->fall().largest_drop_m());
    EXPECT_EQ(fall.state_at(drop_m).q, alone.fallen->fall().state_at(drop_m).q);
    EXPECT_EQ(fall.state_at(drop_m).v, alone.fallen->fall().state_at(drop_m).v);
  }
}

TEST(Falls, ASharedFallGivesEachModelTheSameBitsAsItsOwnFall) {
  const auto models = models_of_one_fall();
  const auto fallen = solve_falls({models.data(), 1}).front().fallen;
  for (const ModelParameters& model : models) {
    const CaseResult shared = Finger(model, fallen).solve(0.9, 0.4, 0.7);
    expect_same_bits(shared, Finger(model).solve(0.9, 0.4, 0.7));
  }
}

TEST(Falls, AFallOfAnotherModelIsRefused) {
  const ModelParameters other = coarse_model(2);
  const auto fallen = solve_falls({&other, 1}).front().fallen;
  EXPECT_THROW(Finger(coarse_model(), fallen), std::invalid_argument);
  ModelParameters wrong = other;
  wrong.k_N_m = -1.0;
  EXPECT_THROW(Finger(wrong, fallen), InputError);
}

TEST(Falls, AFailingFallDoesNotAffectOthers) {
  std::vector<ModelParameters> models(4, coarse_model());
  models[1].E_Pa = -1.0;
  models[2].dt_fall_s = 1e-300;
  models[3].integrator = Integrator::kGeneralizedAlpha;
  models[3].dt_fall_s = 0.025;  // Newton's method does not converge after some steps
  const std::vector<FallOutcome> outcomes = solve_falls(models);
  EXPECT_TRUE(outcomes[0].fallen);
  EXPECT_THAT(outcomes[1].error, HasSubstr("E = -1"));
  EXPECT_THAT(outcomes[2].error, HasSubstr("more than 1e+09 steps"));
  EXPECT_NE(outcomes[3].error, "");
  for (std::size_t i = 1; i < outcomes.size(); ++i) {
    EXPECT_FALSE(outcomes[i].fallen) << i;
  }
}

}  // namespace
}  // namespace oblique::solver
