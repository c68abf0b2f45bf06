#include <atomic>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/library/solver.h"

namespace oblique {
namespace {

using ::testing::HasSubstr;

ModelParameters coarse_model() {
  ModelParameters model = preset("paper");
  model.elements_per_link = 1;
  return model;
}

void expect_same_bits(const CaseResult& a, const CaseResult& b) {
  EXPECT_EQ(a.fn_peak_N, b.fn_peak_N);
  EXPECT_EQ(a.ft_peak_N, b.ft_peak_N);
  EXPECT_EQ(a.duration_s, b.duration_s);
  EXPECT_EQ(a.slide_m, b.slide_m);
  EXPECT_EQ(a.vn_out_m_s, b.vn_out_m_s);
  EXPECT_EQ(a.energy.closure, b.energy.closure);
  EXPECT_EQ(a.mode, b.mode);
}

std::vector<std::optional<Outcome>> outcomes_of(const std::vector<ModelParameters>& models,
                                                const std::vector<ModelPoint>& points,
                                                const ManyOptions& options = {}) {
  std::vector<std::optional<Outcome>> outcomes(points.size());
  EXPECT_TRUE(solve_many(
      models, points,
      [&](Outcome&& outcome) {
        EXPECT_FALSE(outcomes.at(outcome.number))
            << "point " << outcome.number << " was delivered twice";
        outcomes[outcome.number] = std::move(outcome);
      },
      options));
  return outcomes;
}

std::vector<ModelPoint> sweep(std::size_t models) {
  std::vector<ModelPoint> points;
  for (int i = 0; i < 60; ++i) {
    points.push_back({static_cast<std::size_t>(i) % models,
                      {0.3 + 0.2 * (i % 4), 0.1 * (i % 7), 1.0 - 0.1 * (i % 3)}});
  }
  return points;
}

TEST(LibraryTest, ManyPointsInAnyOrderHaveTheSameBitsAsAlone) {
  ModelParameters stiff = coarse_model();
  stiff.k_N_m *= 2.0;
  ModelParameters light = coarse_model();
  light.rho_kg_m3 *= 0.5;
  const std::vector<ModelParameters> models{coarse_model(), stiff, light};
  const std::vector<ModelPoint> points = sweep(models.size());
  const auto outcomes = outcomes_of(models, points, {.threads = 3});
  const auto falls = std::make_shared<FallCache>();
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_TRUE(outcomes[i] && outcomes[i]->result) << i;
    const auto& [model, point] = points[i];
    expect_same_bits(*outcomes[i]->result,
                     Finger(models[model], falls).solve(point.H_m, point.mu, point.e_star));
  }
}

TEST(LibraryTest, AnInvalidPointOrAPointOfAnInvalidModelFailsAlone) {
  ModelParameters wrong = coarse_model();
  wrong.E_Pa = -1.0;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto outcomes = outcomes_of({coarse_model(), wrong}, {{0, {1.0, 0.4, 1.0}},
                                                              {1, {1.0, 0.4, 1.0}},
                                                              {0, {1.0, -0.4, 1.0}},
                                                              {0, {1.0, nan, 1.0}},
                                                              {0, {5.0, 0.4, 1.0}}});
  EXPECT_TRUE(outcomes[0]->result);
  EXPECT_THAT(outcomes[1]->error, HasSubstr("E = -1 Pa is not allowed"));
  EXPECT_THAT(outcomes[2]->error, HasSubstr("mu = -0.4 is not allowed"));
  EXPECT_THAT(outcomes[3]->error, HasSubstr("mu = nan is not allowed"));
  EXPECT_THAT(outcomes[4]->error, HasSubstr("H = 5 m is not allowed"));
}

TEST(LibraryTest, APointOfAnUnknownModelIsRefused) {
  EXPECT_THROW(outcomes_of({coarse_model()}, {{1, {1.0, 0.4, 1.0}}}), InputError);
}

/// Returns a model whose fall takes hours. A test that waits for this fall times out.
ModelParameters model_that_falls_for_hours() {
  ModelParameters model = preset("paper");
  model.integrator = Integrator::kGeneralizedAlpha;
  model.dt_fall_s = 1e-9;
  return model;
}

TEST(LibraryTest, ACallerCanEndTheCallDuringAFallAndGetsNoFurtherOutcome) {
  std::atomic<std::size_t> taken = 0;
  ManyOptions options;
  options.goes_on = [](std::size_t) { return false; };
  EXPECT_FALSE(solve_many(
      std::vector{model_that_falls_for_hours()}, std::vector<ModelPoint>{{0, {1.0, 0.4, 1.0}}},
      [&](Outcome&&) { ++taken; }, options));
  EXPECT_EQ(taken, 0U);
}

TEST(LibraryTest, AnExceptionOfTakeIsRethrownDuringAFall) {
  const auto take = [](Outcome&&) { throw std::runtime_error("the disk is full"); };
  EXPECT_THROW(solve_many(std::vector{coarse_model()}, sweep(1), take), std::runtime_error);
  const std::vector models{coarse_model(), model_that_falls_for_hours()};
  EXPECT_THROW(
      solve_many(models, std::vector<ModelPoint>{{0, {1.0, 0.4, 1.0}}, {1, {1.0, 0.4, 1.0}}}, take,
                 {.threads = 2}),
      std::runtime_error);
}

TEST(LibraryTest, AfterAnExceptionNoFurtherFallIsSolved) {
  ModelParameters finer = coarse_model();
  finer.elements_per_link = 2;
  const auto falls = std::make_shared<FallCache>();
  const auto take = [](Outcome&&) { throw std::runtime_error("the disk is full"); };
  EXPECT_THROW(solve_many(std::vector{coarse_model(), finer},
                          std::vector<ModelPoint>{{0, {1.0, 0.4, 1.0}}, {1, {1.0, 0.4, 1.0}}}, take,
                          {.threads = 1, .falls = falls}),
               std::runtime_error);
  EXPECT_TRUE(falls->kept_fall(coarse_model()));
  EXPECT_FALSE(falls->kept_fall(finer));
}

TEST(LibraryTest, AFingerTakesItsFallFromTheGivenCache) {
  const auto falls = std::make_shared<FallCache>();
  const Finger finger(coarse_model(), falls);
  EXPECT_FALSE(falls->kept_fall(coarse_model())) << "the fall is not solved before it is needed";
  expect_same_bits(finger.solve(1.0, 0.4, 0.9), Finger(coarse_model()).solve(1.0, 0.4, 0.9));
  EXPECT_TRUE(falls->kept_fall(coarse_model()));
}

TEST(LibraryTest, ATraceHasTheResultOfItsPointAndAnExceptionOfItsSinkEndsIt) {
  const Finger finger(coarse_model());
  std::size_t rows = 0;
  Tracing tracing;
  tracing.sink = [&rows](const TraceRow&) { ++rows; };
  expect_same_bits(finger.solve(1.0, 0.4, 0.9, tracing), finger.solve(1.0, 0.4, 0.9));
  EXPECT_GT(rows, 10U);
  tracing.sink = [](const TraceRow&) { throw std::length_error("enough"); };
  EXPECT_THROW(static_cast<void>(finger.solve(1.0, 0.4, 0.9, tracing)), std::length_error);
}

TEST(LibraryTest, EstimatedErrorsAreEqualForOneAndForManyPoints) {
  ModelParameters model = preset("paper");
  model.elements_per_link = 2;
  const Finger finger(model);
  const auto outcomes = outcomes_of({model}, {{0, {1.0, 0.4, 0.9}}}, {.errors = true});
  const auto result = finger.solve(1.0, 0.4, 0.9);
  EXPECT_FALSE(result.errors.fn_peak);
  EXPECT_TRUE(outcomes[0]->result->errors.fn_peak);
  FallCache falls;
  EXPECT_EQ(outcomes[0]->result->errors, errors_by_companion(model, result, falls));
}

TEST(LibraryTest, AnInvalidModelAndAnUnstableStepAreRefusedAtOnce) {
  ModelParameters model = coarse_model();
  model.dt_fall_s = 1.0;
  EXPECT_THROW(Finger{model}, InputError);
  model.dt_fall_s = -1.0;
  EXPECT_THROW(Finger{model}, InputError);
}

}  // namespace
}  // namespace oblique
