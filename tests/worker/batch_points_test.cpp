#include <algorithm>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
#include "tests/support/recipes.h"
#include "tests/worker/conversation_fixture.h"
#include "worker/batch_solver.h"
#include "worker/solver/falls.h"
#include "worker/solver/fast/kernels.h"
#include "worker/solver/point_runs.h"
#include "worker/trace_solver.h"

namespace oblique::worker {
namespace {

constexpr std::size_t kFallBytes = std::size_t{1} << 30U;

Batch batch_of(const protocol::Recipe& recipe) {
  const auto points = std::make_shared<const protocol::PointTable>(recipe);
  return {1, 7, {{0, points->size()}}, points};
}

/// Solves all points of a batch on `threads` threads. Returns the results in the order of the
/// points.
std::vector<protocol::PointResult> solved(const Batch& batch, solver::FallCache& falls,
                                          std::size_t threads = 1) {
  std::promise<void> ended;
  BatchSolver solver(
      [&falls](const Batch& of, auto& points, const auto& take) {
        solver::solve_points_of_models(points, falls, of.points().wants_errors(), take);
      },
      [&ended] { ended.set_value(); }, threads);
  solver.add(batch);
  ended.get_future().wait();
  std::vector<protocol::PointResult> results(batch.size());
  for (Progress& progress : solver.collect()) {
    for (protocol::PointResult& result : progress.results) {
      EXPECT_FALSE(results.at(result.point()).has_model())
          << result.point() << " was delivered twice";
      results.at(result.point()) = std::move(result);
    }
  }
  return results;
}

std::vector<protocol::PointResult> solved(const Batch& batch) {
  solver::FallCache falls(kFallBytes);
  return solved(batch, falls);
}

/// Returns the encoded outputs of a result. `wall_s`, which differs in every run, is set to 0.
std::string bits_of(const protocol::PointResult& result) {
  auto outputs = protocol::from_message(result);
  outputs.solver.wall_s = 0.0;
  return protocol::to_message(0, outputs).SerializeAsString();
}

/// Adds a model axis to the only block. The axis follows other model axes and precedes H, mu and e.
void add_model_axis(protocol::Recipe& recipe, const char* key, const std::vector<double>& values) {
  protocol::Block& block = *recipe.mutable_blocks(0);
  protocol::Axis& axis = *block.add_axes();
  axis.set_key(key);
  for (const double value : values) {
    axis.add_values(value);
  }
  const int last = block.axes_size() - 1;
  for (int i = last; i > last - 3; --i) {
    block.mutable_axes()->SwapElements(i, i - 1);
  }
}

/// Returns a recipe with `points` points for each pair of E and k, on a coarse mesh.
protocol::Recipe recipe_with_models(std::uint64_t points, const std::vector<double>& E_Pa,
                                    const std::vector<double>& k_N_m) {
  protocol::Recipe recipe = recipe_with_points(points);
  solver::ModelParameters model = solver::preset("paper");
  model.elements_per_link = 1;
  *recipe.mutable_model() = protocol::to_message(model);
  add_model_axis(recipe, "E", E_Pa);
  add_model_axis(recipe, "k", k_N_m);
  return recipe;
}

/// Solves falls and records their models.
struct CountedFalls {
  solver::FallCache::Solve solve = [this](std::span<const solver::ModelParameters> models) {
    const std::lock_guard lock(mutex);
    solved.emplace_back(models.begin(), models.end());
    return solver::solve_falls(models);
  };
  std::size_t count() const {
    std::size_t falls = 0;
    for (const auto& together : solved) {
      falls += together.size();
    }
    return falls;
  }

  std::mutex mutex;
  std::vector<std::vector<solver::ModelParameters>> solved;
};

TEST(PointsOfABatch, EveryPointHasTheResultOfSolvingItAlone) {
  const Batch batch = batch_of(recipe_with_points(12));
  const auto results = solved(batch);
  const solver::Finger finger(solver::preset("paper"));
  for (std::uint64_t i = 0; i < batch.size(); ++i) {
    const protocol::Point point = batch.points().point(i);
    const solver::CaseResult expected = finger.solve(point.H_m, point.mu, point.e_star);
    EXPECT_EQ(results[i].error(), "");
    EXPECT_EQ(results[i].point(), i);
    const auto outputs = protocol::from_message(results[i]);
    EXPECT_EQ(outputs.fn_peak_N, expected.fn_peak_N);
    EXPECT_EQ(outputs.vn_out_m_s, expected.vn_out_m_s);
  }
}

TEST(PointsOfABatch, ResultsContainTheInputsOfTheirPointsEvenIfTheyFailed) {
  protocol::Recipe recipe = recipe_with_points(2);
  recipe.mutable_blocks(0)->mutable_axes(0)->add_values(1.19);  // beyond the largest drop
  add_model_axis(recipe, "k", {1e7, 2e7});
  const Batch batch = batch_of(recipe);
  const auto results = solved(batch);
  std::size_t failed = 0;
  for (const protocol::PointResult& result : results) {
    const protocol::Point point = batch.points().point(result.point());
    failed += result.error().empty() ? 0U : 1U;
    ASSERT_TRUE(result.has_h_m() && result.has_model());
    EXPECT_EQ(result.h_m(), point.H_m);
    EXPECT_EQ(result.mu(), point.mu);
    EXPECT_EQ(result.e_star(), point.e_star);
    EXPECT_EQ(result.model().k_n_m(), batch.points().model(point.model).k_N_m);
  }
  EXPECT_EQ(failed, 4U);
}

TEST(PointsOfABatch, AFailedPointHasTheReasonAndTheOthersAreSolved) {
  protocol::Recipe recipe = recipe_with_points(2);
  recipe.mutable_blocks(0)->mutable_axes(0)->add_values(1.19);  // beyond the largest drop
  const auto results = solved(batch_of(recipe));
  ASSERT_EQ(results.size(), 4U);
  EXPECT_EQ(results[1].error(), "");
  EXPECT_NE(results[2].error().find("1.19"), std::string::npos) << results[2].error();
}

TEST(PointsOfABatch, APointWithAForbiddenValueFailsAndNamesItsValues) {
  const Batch batch = batch_of(protocol::recipe_of(
      {{protocol::following("k", "if(mu < 0.5, 2.7e7, -1)"), protocol::listed("H", {0.5}),
        protocol::listed("mu", {0.4, 0.6}), protocol::listed("e", {1.0})}}));
  const auto results = solved(batch);
  EXPECT_EQ(results[0].error(), "");
  EXPECT_NE(results[1].error().find("k = -1 N/m is not allowed"), std::string::npos);
  EXPECT_NE(results[1].error().find("mu = 0.6"), std::string::npos);
}

TEST(PointsOfABatch, AnInvalidModelFailsEachOfItsPointsWithTheReason) {
  // A recipe may contain any positive step, but the solver requires a stable step.
  protocol::Recipe recipe = recipe_with_points(3);
  solver::ModelParameters model = solver::preset("paper");
  model.dt_s = 1.0;
  *recipe.mutable_model() = protocol::to_message(model);
  const auto results = solved(batch_of(recipe));
  ASSERT_EQ(results.size(), 3U);
  for (const auto& result : results) {
    EXPECT_NE(result.error().find("dt = 1"), std::string::npos) << result.error();
  }
}

TEST(PointsOfABatch, PointsOfManyModelsHaveTheResultsOfSolvingThemAlone) {
  const Batch batch = batch_of(recipe_with_models(3, {6e10, 7e10, 8e10}, {2e7, 3e7}));
  ASSERT_EQ(batch.size(), 18U);
  CountedFalls falls;
  solver::FallCache one(kFallBytes, falls.solve);
  solver::FallCache several(kFallBytes, falls.solve);
  const auto results = solved(batch, one);
  EXPECT_EQ(falls.count(), 3U) << "a fall does not depend on k";
  const auto by_threads = solved(batch, several, 3);
  EXPECT_EQ(falls.count(), 6U) << "each fall is solved by one thread only";
  for (std::uint64_t i = 0; i < batch.size(); ++i) {
    const protocol::Point point = batch.points().point(i);
    const solver::CaseResult expected =
        solver::Finger(batch.points().model(point.model)).solve(point.H_m, point.mu, point.e_star);
    for (const auto* result : {&results[i], &by_threads[i]}) {
      EXPECT_EQ(result->error(), "");
      const auto outputs = protocol::from_message(*result);
      EXPECT_EQ(outputs.fn_peak_N, expected.fn_peak_N) << i;
      EXPECT_EQ(outputs.vn_out_m_s, expected.vn_out_m_s) << i;
    }
  }
}

TEST(PointsOfABatch, MissingFallsOfLaterPointsAreSolvedTogetherWithTheFirst) {
  const Batch batch = batch_of(recipe_with_models(2, {5e10, 6e10, 7e10, 8e10}, {2e7, 3e7}));
  CountedFalls falls;
  solver::FallCache cache(kFallBytes, falls.solve);
  solved(batch, cache);
  ASSERT_FALSE(falls.solved.empty());
  const std::size_t lanes = solver::runnable_lane_kernels().front().lanes;
  EXPECT_EQ(falls.solved.front().size(), std::min<std::size_t>(lanes, 4));
  EXPECT_EQ(falls.count(), 4U);
}

TEST(PointsOfABatch, AFailingFallIsSolvedOnceAndFailsOnlyThePointsOfItsModels) {
  protocol::Recipe recipe = recipe_with_models(4, {7e10}, {2e7, 3e7});
  solver::ModelParameters model = solver::preset("paper");
  model.elements_per_link = 1;
  model.integrator = solver::Integrator::kGeneralizedAlpha;
  *recipe.mutable_model() = protocol::to_message(model);
  add_model_axis(recipe, "dt_fall", {0.025, 1e-4});  // Newton's method fails with steps of 0.025 s
  const Batch batch = batch_of(recipe);
  CountedFalls falls;
  solver::FallCache cache(kFallBytes, falls.solve);
  for (int again = 0; again < 2; ++again) {
    const auto results = solved(batch, cache);
    for (const auto& result : results) {
      const bool fails =
          batch.points().model(batch.points().point(result.point()).model).dt_fall_s == 0.025;
      EXPECT_EQ(result.error().empty(), !fails) << result.error();
    }
  }
  EXPECT_EQ(falls.count(), 2U);
}

TEST(PointsOfABatch, EstimatedErrorsAreAddedIfTheStudyWantsThemAndChangeNothingElse) {
  protocol::Recipe recipe = recipe_with_models(3, {7e10, 6e10}, {2.7e7, 1e7});
  recipe.mutable_model()->set_elements_per_link(2);  // a mesh of one element has no coarser mesh
  const auto without = solved(batch_of(recipe));
  recipe.set_errors(true);
  const auto with = solved(batch_of(recipe));
  ASSERT_EQ(with.size(), without.size());
  for (std::size_t i = 0; i < with.size(); ++i) {
    solver::CaseResult result = protocol::from_message(with[i]);
    EXPECT_TRUE(result.errors.mode_same);
    EXPECT_TRUE(result.errors.v_out);
    EXPECT_FALSE(protocol::from_message(without[i]).errors.mode_same);
    result.errors = {};
    EXPECT_EQ(bits_of(protocol::to_message(i, result)), bits_of(without[i]));
  }
}

/// Returns the message with which the server requests the trace of a point.
protocol::TraceOrder order_of(const Batch& batch, std::uint64_t number) {
  const protocol::Point point = batch.points().point(number);
  protocol::TraceOrder order;
  *order.mutable_model() = protocol::to_message(batch.points().model(point.model));
  order.set_h_m(point.H_m);
  order.set_mu(point.mu);
  order.set_e_star(point.e_star);
  order.set_errors(batch.points().wants_errors());
  return order;
}

/// Solves a batch with `points` points of each of two models, then traces the first and the last
/// point. A trace must give the same bits as the batch.
void expect_traces_to_repeat(solver::Integrator integrator, std::size_t points, bool errors,
                             bool shape) {
  solver::ModelParameters model = solver::preset("paper");
  model.integrator = integrator;
  model.elements_per_link = 2;
  if (integrator == solver::Integrator::kGeneralizedAlpha) {
    model.dt_fall_s = 1e-3;  // a longer step than the default, to save time
  }
  protocol::Recipe recipe = recipe_with_points(points);
  *recipe.mutable_model() = protocol::to_message(model);
  add_model_axis(recipe, "k", {2e7, 3e7});
  recipe.set_errors(errors);
  const Batch batch = batch_of(recipe);
  solver::FallCache falls(kFallBytes);
  const auto results = solved(batch, falls);
  for (const std::uint64_t number : {std::uint64_t{0}, batch.size() - 1}) {
    std::size_t rows = 0;
    protocol::TraceOrder order = order_of(batch, number);
    order.set_shape(shape);
    const auto traced = solve_trace(
        order,
        [&](const solver::TraceRow& row) {
          ++rows;
          EXPECT_EQ(row.nodes_m.empty(), !shape);
        },
        falls);
    ASSERT_EQ(traced.error(), "");
    EXPECT_EQ(bits_of(traced), bits_of(results[number]))
        << "errors " << errors << " shape " << shape << " point " << number;
    EXPECT_GT(rows, 10U);
  }
}

TEST(SolveTrace, ATracedPointHasTheSameBitsAsInItsBatch) {
  for (const bool errors : {false, true}) {
    for (const bool shape : {false, true}) {
      expect_traces_to_repeat(solver::Integrator::kExplicit, 12, errors, shape);
    }
  }
}

TEST(SolveTrace, ATracedPointHasTheSameBitsAsInItsBatchWithGeneralizedAlpha) {
  expect_traces_to_repeat(solver::Integrator::kGeneralizedAlpha, 2, false, true);
}

TEST(SolveTrace, ATraceBeginsWithTheFallIfOrdered) {
  solver::ModelParameters model = solver::preset("paper");
  model.elements_per_link = 1;
  protocol::Recipe recipe = recipe_with_points(2);
  *recipe.mutable_model() = protocol::to_message(model);
  solver::FallCache falls(kFallBytes);
  protocol::TraceOrder order = order_of(batch_of(recipe), 0);
  for (const bool fall : {false, true}) {
    order.set_fall(fall);
    std::vector<std::string> states;
    solve_trace(
        order, [&](const solver::TraceRow& row) { states.push_back(row.state); }, falls);
    ASSERT_FALSE(states.empty());
    EXPECT_EQ(std::count(states.begin(), states.end(), solver::kFalling),
              fall ? solver::kFallRows : 0);
    EXPECT_EQ(states.front() == solver::kFalling, fall);
  }
}

TEST(SolveTrace, TheTraceOfAFailingPointFailsWithItsReason) {
  solver::FallCache falls(kFallBytes);
  const Batch batch = batch_of(recipe_with_points(2));
  protocol::TraceOrder order = order_of(batch, 0);
  order.set_h_m(1.19);  // beyond the largest drop
  const auto nothing = [](const solver::TraceRow&) {};
  EXPECT_NE(solve_trace(order, nothing, falls).error().find("1.19"), std::string::npos);
  order.mutable_model()->set_e_pa(-1.0);
  EXPECT_NE(solve_trace(order, nothing, falls).error().find("E = -1"), std::string::npos);
}

}  // namespace
}  // namespace oblique::worker
