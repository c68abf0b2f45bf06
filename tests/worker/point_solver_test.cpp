#include "worker/point_solver.h"

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
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

Batch batch_of(const protocol::Recipe& recipe) {
  const auto points = std::make_shared<const protocol::PointTable>(recipe);
  return {1, 7, 0, 0, points->size(), points};
}

/// Solves all points of a batch; the results in the order of the points.
std::vector<protocol::PointResult> solved(const Batch& batch) {
  PointSolver solver(2);
  std::vector<protocol::PointResult> results(batch.count);
  std::uint64_t given = 0;
  solver.solve(
      batch,
      [&] {
        return given < batch.count ? std::optional(batch.first_point + given++) : std::nullopt;
      },
      [&](protocol::PointResult&& result) { results.at(result.point()) = std::move(result); });
  return results;
}

TEST(PointSolverTest, EveryPointGivesWhatTheFingerGivesForItAlone) {
  const Batch batch = batch_of(recipe_with_points(12));
  const auto results = solved(batch);
  const solver::Finger finger({});
  for (std::uint64_t i = 0; i < batch.count; ++i) {
    const protocol::Point point = batch.points->point(i);
    const solver::CaseResult expected = finger.solve(point.H_m, point.mu, point.e_star);
    EXPECT_EQ(results[i].error(), "");
    EXPECT_EQ(results[i].point(), i);
    const auto outputs = protocol::from_message(results[i]);
    EXPECT_EQ(outputs.fn_peak_N, expected.fn_peak_N);
    EXPECT_EQ(outputs.vn_out_m_s, expected.vn_out_m_s);
  }
}

TEST(PointSolverTest, APointWithoutAnswerFailsWithTheReasonAndTheOthersAreSolved) {
  protocol::Recipe recipe = recipe_with_points(2);
  recipe.mutable_blocks(0)->mutable_axes(0)->add_values(1.19);  // beyond the largest drop
  const auto results = solved(batch_of(recipe));
  ASSERT_EQ(results.size(), 4U);
  EXPECT_EQ(results[1].error(), "");
  EXPECT_NE(results[2].error().find("1.19"), std::string::npos) << results[2].error();
}

TEST(PointSolverTest, AModelThatMakesNoFingerFailsEachPointWithTheReason) {
  // The recipe takes any positive number, the solver only one that leaves it a step.
  protocol::Recipe recipe = recipe_with_points(3);
  solver::ModelParameters model;
  model.dt_s = 1.0;
  *recipe.mutable_model() = protocol::to_message(model);
  const auto results = solved(batch_of(recipe));
  ASSERT_EQ(results.size(), 3U);
  for (const auto& result : results) {
    EXPECT_NE(result.error().find("dt = 1"), std::string::npos) << result.error();
  }
}

}  // namespace
}  // namespace oblique::worker
