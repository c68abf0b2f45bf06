#include "worker/solver/model/relative_cost.h"

#include <gtest/gtest.h>

namespace oblique::solver {
namespace {

TEST(RelativeCost, IsMeasuredInPointsOfTheDefault) {
  EXPECT_DOUBLE_EQ(relative_cost(preset("standard")).value(), 1.0);
}

TEST(RelativeCost, GrowsWithElementsLinksAndAccuracyAsSweepsDo) {
  // Sweeps with AVX-512 solve some 7,000 cases/s a core on 4 elements a link, and 100 on 48
  // (worker/solver/README.md).
  const double paper = relative_cost(preset("paper")).value();
  EXPECT_NEAR(relative_cost(preset("converged")).value() / paper, 70.0, 20.0);
  ModelParameters model = preset("paper");
  model.tolerance = 1e-9;
  EXPECT_DOUBLE_EQ(relative_cost(model).value() / paper, 10.0) << "steps are ten times shorter";
  model = preset("paper");
  model.lengths_m.assign(6, 0.4);
  EXPECT_NEAR(relative_cost(model).value() / paper, 1.57, 0.01);
}

TEST(RelativeCost, IsNotKnownOfStepsThatFollowFromSomethingElse) {
  ModelParameters model = preset("paper");
  model.dt_s = 1e-7;
  EXPECT_FALSE(relative_cost(model));
  model = preset("paper");
  model.integrator = Integrator::kGeneralizedAlpha;
  EXPECT_FALSE(relative_cost(model));
}

}  // namespace
}  // namespace oblique::solver
