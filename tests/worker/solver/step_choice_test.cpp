#include "worker/solver/step_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "worker/solver/model/errors.h"
#include "worker/solver/reference/pefrl.h"

namespace oblique::solver {
namespace {

double limit_s(const Chain& chain, double tip_stiffness_N_m) {
  return Pefrl::stability_limit() / chain.highest_frequency_rad_s(tip_stiffness_N_m);
}

TEST(StepChoice, LimitsAreThoseOfTheStiffestSpringOfEachPhase) {
  ModelParameters model = preset("paper");
  const Chain chain(model);
  const auto limits = [&](double eta2, double e_star) {
    model.eta2 = eta2;
    return StepChoice(chain, model).contact_limits(e_star);
  };
  const double k = model.k_N_m;
  EXPECT_DOUBLE_EQ(limits(1.25, 0.5).compression_s, limit_s(chain, k));
  EXPECT_DOUBLE_EQ(limits(1.25, 0.5).restitution_s, limit_s(chain, 4.0 * k));
  // With these eta2 the tangential spring is stiffer than the normal spring.
  EXPECT_DOUBLE_EQ(limits(0.125, 0.5).compression_s, limit_s(chain, 8.0 * k));
  EXPECT_DOUBLE_EQ(limits(0.125, 0.5).restitution_s, limit_s(chain, 8.0 * k));
  EXPECT_DOUBLE_EQ(limits(0.125, 0.25).restitution_s, limit_s(chain, 16.0 * k));
}

TEST(StepChoice, TheErrorModelGivesTheToleranceAtTheChosenStep) {
  ModelParameters model = preset("paper");
  for (const double tolerance : {1e-5, 1e-7}) {
    model.tolerance = tolerance;
    const Chain chain(model);
    const double h_s = StepChoice(chain, model).contact(1.0).compression_s;
    const double tip = h_s * std::sqrt(model.k_N_m / chain.tip_inertia_kg());
    const double highest = h_s * chain.highest_frequency_rad_s(model.k_N_m);
    EXPECT_NEAR(StepChoice::kErrorFactor * tip * tip * tip * highest, tolerance, 1e-9 * tolerance);
  }
  EXPECT_DOUBLE_EQ(StepChoice(Chain(model), model).contact(0.4).restitution_s,
                   StepChoice(Chain(model), model).contact(1.0).compression_s);
}

TEST(StepChoice, StepsShrinkWithFastRestitutionInBothPhases) {
  const ModelParameters model = preset("paper");
  const Chain chain(model);
  const StepChoice steps(chain, model);
  const double usual_s = steps.contact(1.0).compression_s;
  EXPECT_DOUBLE_EQ(steps.contact(0.1).restitution_s, usual_s / 4.0);
  EXPECT_DOUBLE_EQ(steps.contact(0.1).compression_s, usual_s / 4.0);
  EXPECT_DOUBLE_EQ(steps.contact(0.001).restitution_s, usual_s / 400.0);
  EXPECT_DOUBLE_EQ(steps.contact(0.001).compression_s, usual_s / 8.0);
}

TEST(StepChoice, ChosenStepsAreStableForAllModels) {
  const auto expect_below = [](const ModelParameters& model) {
    const Chain chain(model);
    const StepChoice steps(chain, model);
    for (const double e_star : {0.001, 0.02, 0.4, 1.0}) {
      const ContactSteps limits = steps.contact_limits(e_star);
      const ContactSteps chosen = steps.contact(e_star);
      EXPECT_GT(chosen.restitution_s, 0.0);
      EXPECT_LE(chosen.compression_s, StepChoice::kLongestFraction * limits.compression_s);
      EXPECT_LE(chosen.restitution_s, StepChoice::kLongestFraction * limits.restitution_s);
    }
    EXPECT_LT(steps.fall_s(), limit_s(chain, 0.0));
  };
  for (const int elements : {1, 4, 64}) {
    for (const double k : {1.0, 2.7e7, 1e12}) {
      for (const double tolerance : {1e-9, 1e-5, 1e-2}) {
        ModelParameters model = preset("paper");
        model.elements_per_link = elements;
        model.k_N_m = k;
        model.tolerance = tolerance;
        expect_below(model);
      }
    }
  }
  ModelParameters heavy = preset("paper");
  heavy.tip_mass_kg = 100.0;
  expect_below(heavy);
  const Chain chain(heavy);
  EXPECT_DOUBLE_EQ(
      StepChoice(chain, heavy).contact(1.0).compression_s,
      StepChoice::kLongestFraction * StepChoice(chain, heavy).contact_limits(1.0).compression_s)
      << "a heavy tip is slow, so that only stability limits the step";
}

TEST(StepChoice, AFallIsAsAccurateAsTheContactAndAtLeastAsByDefault) {
  for (const auto integrator : {Integrator::kExplicit, Integrator::kGeneralizedAlpha}) {
    ModelParameters model = preset("paper");
    model.integrator = integrator;
    const Chain chain(model);
    const double usual_s = StepChoice(chain, model).fall_s();
    model.tolerance = 1e-3;
    EXPECT_EQ(StepChoice(chain, model).fall_s(), usual_s);
    const bool is_explicit = integrator == Integrator::kExplicit;
    model.tolerance = is_explicit ? 1e-4 * StepChoice::kFallTolerance : 1e-9;
    EXPECT_DOUBLE_EQ(
        StepChoice(chain, model).fall_s(),
        is_explicit ? 0.1 * StepChoice::kFallFraction * limit_s(chain, 0.0) : 0.01 * usual_s);
  }
}

TEST(StepChoice, GeneralizedAlphaFollowsTheToleranceByItsOrder) {
  ModelParameters model = preset("paper");
  model.integrator = Integrator::kGeneralizedAlpha;
  const Chain chain(model);
  const double usual_s = StepChoice(chain, model).contact(1.0).compression_s;
  model.tolerance = 1e-7;
  EXPECT_DOUBLE_EQ(StepChoice(chain, model).contact(1.0).compression_s, 0.1 * usual_s);
}

TEST(StepChoice, AGivenStepIsUsedUpToTheLimitAndRefusedAboveIt) {
  ModelParameters model = preset("paper");
  const Chain chain(model);
  const double limit = StepChoice(chain, model).contact_limits(0.5).restitution_s;
  model.dt_s = 0.999 * limit;
  EXPECT_EQ(StepChoice(chain, model).contact(0.5).compression_s, model.dt_s);
  EXPECT_EQ(StepChoice(chain, model).contact(0.5).restitution_s, model.dt_s);
  model.dt_s = 1.001 * limit;
  EXPECT_THROW(StepChoice(chain, model).contact(0.5), InputError);
  model = preset("paper");
  model.dt_fall_s = 1.001 * limit_s(chain, 0.0);
  EXPECT_THROW(StepChoice(chain, model), InputError);
  model.dt_fall_s = 0.999 * limit_s(chain, 0.0);
  EXPECT_EQ(StepChoice(chain, model).fall_s(), model.dt_fall_s);
}

TEST(StepChoice, ARestitutionTooSmallForDoublePrecisionIsAnError) {
  const ModelParameters model = preset("paper");
  const Chain chain(model);
  const StepChoice steps(chain, model);
  EXPECT_NO_THROW(steps.contact(0.001));
  EXPECT_THROW(steps.contact(0.0009), SolveError);
}

}  // namespace
}  // namespace oblique::solver
