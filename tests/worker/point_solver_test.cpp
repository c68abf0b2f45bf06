#include "worker/point_solver.h"

#include <limits>

#include <gtest/gtest.h>

#include "tests/worker/conversation_fixture.h"
#include "worker/fall_cache.h"

namespace oblique::worker {
namespace {

solver::ModelParameters model_with_k(double k_N_m) {
  solver::ModelParameters model;
  model.k_N_m = k_N_m;
  return model;
}

TEST(FallCacheTest, EqualModelsShareOneFinger) {
  FallCache cache(8);
  EXPECT_EQ(cache.finger(model_with_k(1e7)), cache.finger(model_with_k(1e7)));
  EXPECT_NE(cache.finger(model_with_k(1e7)), cache.finger(model_with_k(2e7)));
}

TEST(FallCacheTest, TheFingerNotUsedForLongestMakesRoomForANewOne) {
  FallCache cache(2);
  const auto first = cache.finger(model_with_k(1e7));
  const auto second = cache.finger(model_with_k(2e7));
  EXPECT_EQ(cache.finger(model_with_k(1e7)), first);
  cache.finger(model_with_k(3e7));
  EXPECT_EQ(cache.finger(model_with_k(1e7)), first);
  EXPECT_NE(cache.finger(model_with_k(2e7)), second);
  EXPECT_EQ(second->model().k_N_m, 2e7);
}

TEST(FallCacheTest, AModelOutsideItsDomainIsAnErrorAndIsNotKept) {
  FallCache cache(2);
  EXPECT_THROW(cache.finger(model_with_k(-1.0)), solver::InputError);
  EXPECT_THROW(cache.finger(model_with_k(-1.0)), solver::InputError);
}

Task task_of(const protocol::Recipe& recipe) {
  const auto points = std::make_shared<const protocol::PointTable>(recipe);
  return {1, 7, 0, 0, points->size(), points};
}

TEST(PointSolverTest, APointGivesWhatTheFingerGives) {
  const Task task = task_of(recipe_with_points(3));
  PointSolver solver(2);
  const protocol::PointResult result = solver.solve(task, 1);
  const solver::CaseResult expected = solver::Finger({}).solve(1.0, 0.4, 0.75);
  EXPECT_EQ(result.error(), "");
  EXPECT_EQ(result.point(), 1U);
  EXPECT_EQ(result.fn_peak_n(), expected.fn_peak_N);
  EXPECT_EQ(result.vn_out_m_s(), expected.vn_out_m_s);
}

TEST(PointSolverTest, APointWithoutAnswerFailsWithTheReason) {
  protocol::Recipe recipe = recipe_with_points(2);
  recipe.mutable_blocks(0)->mutable_axes(0)->set_values(0, 1.19);  // beyond the largest drop
  PointSolver solver(2);
  const protocol::PointResult result = solver.solve(task_of(recipe), 0);
  EXPECT_EQ(result.point(), 0U);
  EXPECT_NE(result.error().find("1.19"), std::string::npos) << result.error();
}

TEST(PointSolverTest, AValueThatIsNotFiniteIsFoundWhereverItIs) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  protocol::PointResult result;
  EXPECT_TRUE(is_finite(result));
  result.set_closure(nan);
  EXPECT_FALSE(is_finite(result));
  result.set_closure(0.0);
  result.add_peaks(std::numeric_limits<double>::infinity());
  EXPECT_FALSE(is_finite(result));
  result.clear_peaks();
  result.add_stick_intervals(nan);
  EXPECT_FALSE(is_finite(result));
}

}  // namespace
}  // namespace oblique::worker
