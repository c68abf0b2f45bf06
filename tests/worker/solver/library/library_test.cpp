#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "worker/solver/library/falls_kept.h"
#include "worker/solver/library/solver.h"
#include "worker/solver/solve.h"

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
                                                const std::vector<Point>& points,
                                                const ManyOptions& options = {}) {
  std::vector<std::optional<Outcome>> outcomes(points.size());
  EXPECT_TRUE(solve_many(
      models, points,
      [&](Outcome&& outcome) {
        EXPECT_FALSE(outcomes.at(outcome.point)) << "point " << outcome.point << " came twice";
        outcomes[outcome.point] = std::move(outcome);
      },
      options));
  return outcomes;
}

std::vector<Point> sweep(std::size_t models) {
  std::vector<Point> points;
  for (int i = 0; i < 60; ++i) {
    points.push_back({0.3 + 0.2 * (i % 4), 0.1 * (i % 7), 1.0 - 0.1 * (i % 3),
                      static_cast<std::size_t>(i) % models});
  }
  return points;
}

TEST(LibraryTest, AFingerGivesTheBitsOfTheSolverInside) {
  const ModelParameters model = coarse_model();
  expect_same_bits(Finger(model).solve(1.0, 0.4, 0.9), solver::Finger(model).solve(1.0, 0.4, 0.9));
}

TEST(LibraryTest, ManyPointsInAnyOrderGiveTheBitsOfEachAlone) {
  ModelParameters stiff = coarse_model();
  stiff.k_N_m *= 2.0;
  ModelParameters light = coarse_model();
  light.rho_kg_m3 *= 0.5;
  const std::vector<ModelParameters> models{coarse_model(), stiff, light};
  const std::vector<Point> points = sweep(models.size());
  const auto outcomes = outcomes_of(models, points, {.threads = 3});
  const Falls falls;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_TRUE(outcomes[i] && outcomes[i]->result) << i;
    const Point& point = points[i];
    expect_same_bits(*outcomes[i]->result,
                     Finger(models[point.model], falls).solve(point.H_m, point.mu, point.e));
  }
}

TEST(LibraryTest, NoPointsAreDoneAtOnce) {
  EXPECT_TRUE(outcomes_of({coarse_model()}, {}).empty());
}

TEST(LibraryTest, APointOutsideItsRangeOrOfAModelOutsideItsDomainFailsAlone) {
  ModelParameters wrong = coarse_model();
  wrong.E_Pa = -1.0;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto outcomes = outcomes_of(
      {coarse_model(), wrong},
      {{1.0, 0.4, 1.0}, {1.0, 0.4, 1.0, 1}, {1.0, -0.4, 1.0}, {1.0, nan, 1.0}, {5.0, 0.4, 1.0}});
  EXPECT_TRUE(outcomes[0]->result);
  EXPECT_THAT(outcomes[1]->error, HasSubstr("E = -1 Pa is not allowed"));
  EXPECT_THAT(outcomes[2]->error, HasSubstr("mu = -0.4 is not allowed"));
  EXPECT_THAT(outcomes[3]->error, HasSubstr("mu = nan is not allowed"));
  EXPECT_THAT(outcomes[4]->error, HasSubstr("H = 5 m is not allowed"));
}

TEST(LibraryTest, APointOfAModelThatIsNotGivenIsRefused) {
  EXPECT_THROW(outcomes_of({coarse_model()}, {{1.0, 0.4, 1.0, 1}}), InputError);
}

TEST(LibraryTest, APointOfAModelWithANaNFailsAloneWithWhatIsNoNumber) {
  std::vector<ModelParameters> models{coarse_model()};
  std::vector<Point> points{{1.0, 0.4, 1.0}};
  std::vector<std::string> names;
  for (const auto& key : model_keys()) {
    if (key.name == "links" || key.name == "elements_per_link" || key.name == "integrator") {
      continue;  // whole numbers
    }
    ModelParameters model = coarse_model();
    key.set(model, std::numeric_limits<double>::quiet_NaN());
    names.emplace_back(key.name);
    points.push_back({1.0, 0.4, 1.0, models.size()});
    models.push_back(model);
  }
  ASSERT_GT(names.size(), 10U);
  for (const bool errors : {false, true}) {
    const auto outcomes = outcomes_of(models, points, {.threads = 2, .errors = errors});
    EXPECT_TRUE(outcomes[0]->result);
    for (std::size_t i = 0; i < names.size(); ++i) {
      EXPECT_THAT(outcomes[i + 1]->error, HasSubstr("must be finite")) << names[i];
    }
  }
}

TEST(LibraryTest, PointsAreInOrderThoughSomeHaveNaNs) {
  std::vector<Point> points;
  for (int i = 0; i < 100; ++i) {
    points.push_back({i % 3 == 0 ? std::numeric_limits<double>::quiet_NaN() : 200.0 - i, 0.4, 1.0});
  }
  std::vector<double> handed_on_m;
  solve_many(std::vector{coarse_model()}, points,
             [&](Outcome&& outcome) { handed_on_m.push_back(points.at(outcome.point).H_m); },
             {.threads = 1});
  EXPECT_EQ(handed_on_m.size(), points.size());
  std::erase_if(handed_on_m, [](double H_m) { return std::isnan(H_m); });
  EXPECT_TRUE(std::is_sorted(handed_on_m.begin(), handed_on_m.end()));
}

/// Its fall takes hours: a test that waits for it is ended by its time limit and by nothing else.
ModelParameters model_that_falls_for_hours() {
  ModelParameters model = preset("paper");
  model.integrator = Integrator::kGeneralizedAlpha;
  model.dt_fall_s = 1e-9;
  return model;
}

TEST(LibraryTest, WhoeverAsksToEndIsAnsweredWhileAFallIsStillSolvedAndGetsNothingMore) {
  std::atomic<std::size_t> taken = 0;
  ManyOptions options;
  options.goes_on = [](std::size_t) { return false; };
  EXPECT_FALSE(solve_many(
      std::vector{model_that_falls_for_hours()}, std::vector<Point>{{1.0, 0.4, 1.0}},
      [&](Outcome&&) { ++taken; }, options));
  EXPECT_EQ(taken, 0U);
}

TEST(LibraryTest, WhatTheTakerThrowsComesOutWhileAFallIsStillSolved) {
  const auto take = [](Outcome&&) { throw std::runtime_error("the disk is full"); };
  EXPECT_THROW(solve_many(std::vector{coarse_model()}, sweep(1), take), std::runtime_error);
  const std::vector models{coarse_model(), model_that_falls_for_hours()};
  EXPECT_THROW(solve_many(models, std::vector<Point>{{1.0, 0.4, 1.0, 0}, {1.0, 0.4, 1.0, 1}}, take,
                          {.threads = 2}),
               std::runtime_error);
}

TEST(LibraryTest, NoFallIsBegunBehindTheEndOfTheWork) {
  ModelParameters finer = coarse_model();
  finer.elements_per_link = 2;
  const Falls falls;
  const auto take = [](Outcome&&) { throw std::runtime_error("the disk is full"); };
  EXPECT_THROW(solve_many(std::vector{coarse_model(), finer},
                          std::vector<Point>{{1.0, 0.4, 1.0, 0}, {1.0, 0.4, 1.0, 1}}, take,
                          {.threads = 1, .falls = falls}),
               std::runtime_error);
  EXPECT_TRUE(falls.cache()->falls.kept_fall(coarse_model()));
  EXPECT_FALSE(falls.cache()->falls.kept_fall(finer));
}

TEST(LibraryTest, FingersOverTheSameFallsSolveThemOnce) {
  const Falls falls;
  const Finger finger(coarse_model(), falls);
  expect_same_bits(finger.solve(1.0, 0.4, 0.9), Finger(coarse_model(), falls).solve(1.0, 0.4, 0.9));
}

TEST(LibraryTest, ATraceHasTheResultOfItsPointAndWhatItsSinkThrowsEndsIt) {
  const Finger finger(coarse_model());
  std::size_t rows = 0;
  Tracing tracing;
  tracing.sink = [&rows](const TraceRow&) { ++rows; };
  expect_same_bits(finger.trace(1.0, 0.4, 0.9, tracing), finger.solve(1.0, 0.4, 0.9));
  EXPECT_GT(rows, 10U);
  tracing.sink = [](const TraceRow&) { throw std::length_error("enough"); };
  EXPECT_THROW(static_cast<void>(finger.trace(1.0, 0.4, 0.9, tracing)), std::length_error);
}

TEST(LibraryTest, ErrorsAreThoseThatManyPointsHave) {
  ModelParameters model = preset("paper");
  model.elements_per_link = 2;
  const Finger finger(model);
  const auto outcomes = outcomes_of({model}, {{1.0, 0.4, 0.9}}, {.errors = true});
  const auto result = finger.solve(1.0, 0.4, 0.9);
  EXPECT_FALSE(result.errors.fn_peak);
  EXPECT_TRUE(outcomes[0]->result->errors.fn_peak);
  EXPECT_EQ(outcomes[0]->result->errors, finger.estimated_errors(result));
}

TEST(LibraryTest, AModelOutsideItsDomainAndAStepThatIsTooLongAreRefusedAtOnce) {
  ModelParameters model = coarse_model();
  model.dt_fall_s = 1.0;
  EXPECT_THROW(Finger{model}, InputError);
  model.dt_fall_s = -1.0;
  EXPECT_THROW(Finger{model}, InputError);
}

}  // namespace
}  // namespace oblique
