#include "worker/solver/step_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "worker/solver/model/errors.h"
#include "worker/solver/motion/pefrl.h"

namespace oblique::solver {
namespace {

double limit_s(const Chain& chain, double tip_stiffness_N_m) {
  return Pefrl::stability_limit() / chain.highest_frequency_rad_s(tip_stiffness_N_m);
}

TEST(StepChoice, LimitsAreThoseOfTheStiffestSpringOfEachPhase) {
  ModelParameters model;
  const Chain chain(model);
  const auto limits = [&](double eta2, double e_star) {
    model.eta2 = eta2;
    return StepChoice(chain, model).contact_limits(e_star);
  };
  const double k = model.k_N_m;
  EXPECT_DOUBLE_EQ(limits(1.25, 0.5).compression_s, limit_s(chain, k));
  EXPECT_DOUBLE_EQ(limits(1.25, 0.5).restitution_s, limit_s(chain, 4.0 * k));
  // A tangential spring harder than the normal one.
  EXPECT_DOUBLE_EQ(limits(0.125, 0.5).compression_s, limit_s(chain, 8.0 * k));
  EXPECT_DOUBLE_EQ(limits(0.125, 0.5).restitution_s, limit_s(chain, 8.0 * k));
  EXPECT_DOUBLE_EQ(limits(0.125, 0.25).restitution_s, limit_s(chain, 16.0 * k));
}

TEST(StepChoice, WithoutAStepAskedForFractionsOfTheLimitsAreTaken) {
  const ModelParameters model;
  const Chain chain(model);
  const StepChoice steps(chain, model);
  EXPECT_DOUBLE_EQ(steps.fall_s(), StepChoice::kFallFraction * limit_s(chain, 0.0));
  EXPECT_DOUBLE_EQ(steps.contact(1.0).compression_s,
                   StepChoice::kContactFraction * steps.contact_limits(1.0).compression_s);
  // Restitution steps shrink when it is fast, and never grow.
  EXPECT_LE(steps.contact(1.0).restitution_s, steps.contact(1.0).compression_s);
  EXPECT_LT(steps.contact(0.1).restitution_s, 0.5 * steps.contact(0.1).compression_s);
  for (const double e_star : {0.001, 0.02, 0.1, 0.5}) {
    EXPECT_LT(steps.contact(e_star).restitution_s, steps.contact_limits(e_star).restitution_s);
  }
}

TEST(StepChoice, StepAskedForIsTakenUpToTheLimitAndRefusedAbove) {
  ModelParameters model;
  const Chain chain(model);
  const double limit = StepChoice(chain, model).contact_limits(0.5).restitution_s;
  model.dt_s = 0.999 * limit;
  EXPECT_EQ(StepChoice(chain, model).contact(0.5).compression_s, model.dt_s);
  EXPECT_EQ(StepChoice(chain, model).contact(0.5).restitution_s, model.dt_s);
  model.dt_s = 1.001 * limit;
  EXPECT_THROW(StepChoice(chain, model).contact(0.5), InputError);
  model = {};
  model.dt_fall_s = 1.001 * limit_s(chain, 0.0);
  EXPECT_THROW(StepChoice(chain, model), InputError);
  model.dt_fall_s = 0.999 * limit_s(chain, 0.0);
  EXPECT_EQ(StepChoice(chain, model).fall_s(), model.dt_fall_s);
}

TEST(StepChoice, RestitutionTooSmallForDoublePrecisionIsAnErrorNotAWrongNumber) {
  const ModelParameters model;
  const Chain chain(model);
  const StepChoice steps(chain, model);
  EXPECT_NO_THROW(steps.contact(0.001));
  EXPECT_THROW(steps.contact(0.0009), SolveError);
}

}  // namespace
}  // namespace oblique::solver
