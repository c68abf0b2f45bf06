#include "client/convergence/step_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <sstream>

namespace oblique::client {
namespace {

/// A short chain, for the test's time.
StepStudyCase small_case() {
  solver::ModelParameters model = solver::preset("paper");
  model.lengths_m = {0.2};
  return {"small", model, 12, 0.4, 1.0, {0.5, 1.0, 2.0}};
}

TEST(StepStudy, PointsAreSpreadOverTheirRangesTheSameEachTime) {
  StepStudyCase of = small_case();
  of.points = 64;
  const auto points = step_study_points(of, 2.0);
  ASSERT_EQ(points.size(), 64U);
  std::set<int> cells;
  for (const auto& point : points) {
    EXPECT_GT(point.H_m, 0.3);
    EXPECT_LT(point.H_m, 1.95);
    EXPECT_GE(point.e_star, 0.4);
    EXPECT_LE(point.e_star, 1.0);
    cells.insert((point.H_m > 1.14 ? 1 : 0) + (point.mu > 1.0 ? 2 : 0) +
                 (point.e_star > 0.7 ? 4 : 0));
  }
  EXPECT_EQ(cells.size(), 8U);
  EXPECT_EQ(step_study_points(of, 2.0).front().mu, points.front().mu);
}

TEST(StepStudy, ErrorsFallWithTheStepAndAreWithinTheTolerance) {
  const auto results = step_study({small_case()}, [](const StepStudyResult&) {});
  ASSERT_EQ(results.size(), 1U);
  const auto& steps = results.front().steps;
  ASSERT_EQ(steps.size(), 3U);
  EXPECT_DOUBLE_EQ(steps[2].step_s, 2.0 * steps[1].step_s);
  EXPECT_LT(steps[0].duration, steps[1].duration);
  EXPECT_LT(steps[1].duration, steps[2].duration);
  EXPECT_LE(steps[1].peaks, 1e-5);
  EXPECT_LE(steps[1].duration, 1e-5);
  std::ostringstream table;
  print_step_study(table, results, Format::kTable);
  EXPECT_THAT(table.str(), testing::HasSubstr("small, 0.5 h"));
}

TEST(StepStudy, CoversMeshesStiffnessesRestitutionTipMassesAndLengths) {
  std::set<std::string> names;
  for (const auto& of : step_study_cases({})) {
    EXPECT_NO_THROW(solver::validate(of.model)) << of.name;
    EXPECT_TRUE(names.insert(of.name).second) << of.name;
  }
  for (const char* name : {"n = 4", "n = 32", "k = 1e+09", "e* from 0.05 to 0.2"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
}

}  // namespace
}  // namespace oblique::client
