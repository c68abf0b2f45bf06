#include "worker/solver/estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tests/worker/solver/cases/same_bits.h"
#include "tests/worker/solver/cases/shared_fingers.h"
#include "worker/solver/falls.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/result_fields.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/solve.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {
namespace {

ContactSteps steps_of(const ModelParameters& model, double e_star) {
  const Chain chain(model);
  return StepChoice(chain, model).contact(e_star);
}

/// Returns a model with a contact so soft that two elements per link resolve its waves.
ModelParameters soft_model(int elements_per_link) {
  ModelParameters model = coarse_model(elements_per_link);
  model.k_N_m *= 0.01;
  return model;
}

CaseResult some_result() {
  static const CaseResult result = coarse_finger().solve(0.8, 1.2, 0.7);
  return result;
}

TEST(Companion, HasHalfTheElementsRoundedDownAndAtLeastOne) {
  for (const auto& [elements, half] : std::vector<std::pair<int, int>>{
           {1, 1}, {2, 1}, {3, 1}, {4, 2}, {5, 2}, {16, 8}, {256, 128}}) {
    EXPECT_EQ(companion_model(coarse_model(elements)).elements_per_link, half) << elements;
  }
}

TEST(Companion, TakesTwiceTheStepWhetherItIsChosenOrGiven) {
  for (const Integrator integrator : {Integrator::kExplicit, Integrator::kGeneralizedAlpha}) {
    for (const double dt_s : {0.0, 1e-7}) {
      ModelParameters model = coarse_model();
      model.integrator = integrator;
      model.dt_s = dt_s;
      for (const double e_star : {0.1, 1.0}) {
        const ContactSteps steps = steps_of(model, e_star);
        const ContactSteps doubled = steps_of(companion_model(model), e_star);
        EXPECT_EQ(doubled.compression_s, 2.0 * steps.compression_s);
        EXPECT_EQ(doubled.restitution_s, 2.0 * steps.restitution_s);
      }
    }
  }
}

TEST(Companion, TakesTheLongestStableStepIfTwiceTheStepIsUnstable) {
  ModelParameters model = coarse_model();
  const Chain chain(model);
  const double limit_s = StepChoice(chain, model).contact_limits(1.0).restitution_s;
  model.dt_s = 0.8 * limit_s;
  const double step_s = steps_of(companion_model(model), 1.0).restitution_s;
  EXPECT_GT(step_s, model.dt_s);
  EXPECT_LT(step_s, limit_s);
}

TEST(Companion, OfOneElementSharesItsFall) {
  const ModelParameters model = coarse_model();
  EXPECT_EQ(fall_model(companion_model(model)), fall_model(model));
}

TEST(EstimatedErrors, AreZeroIfBothSolutionsAreEqual) {
  const ErrorEstimate errors = estimated_errors(coarse_model(4), some_result(), some_result());
  EXPECT_EQ(errors.mode_same, 1);
  for (const auto& error : {errors.fn_peak, errors.ft_peak, errors.duration, errors.stick_total,
                            errors.slide, errors.impulse_n, errors.impulse_t, errors.v_out}) {
    EXPECT_EQ(error, 0.0);
  }
}

TEST(EstimatedErrors, GrowWithTheDifferenceAndWithWavesThatTheCoarserMeshDoesNotResolve) {
  CaseResult near = some_result();
  near.duration_s *= 1.01;
  CaseResult far = some_result();
  far.duration_s *= 1.02;
  far.major_mode = "sC sR";
  const double tolerance = coarse_model().tolerance;
  const auto error = [&](int elements_per_link, const CaseResult& companion) {
    return *estimated_errors(coarse_model(elements_per_link), some_result(), companion).duration -
           tolerance;
  };
  EXPECT_NEAR(error(16, far) / error(16, near), 2.0, 1e-9);
  EXPECT_GT(error(4, near), 5.0 * error(16, near));
  // If both meshes resolve the waves, the estimate is a third of the difference (order 2).
  EXPECT_NEAR(error(64, near), 0.01 / 3.0, 1e-5);
  EXPECT_EQ(estimated_errors(coarse_model(4), some_result(), near).mode_same, 1);
  EXPECT_EQ(estimated_errors(coarse_model(4), some_result(), far).mode_same, 0);
}

TEST(EstimatedErrors, OfTheExitVelocityAreThoseOfTheVector) {
  CaseResult companion = some_result();
  companion.vt_out_m_s += 0.1;
  const double one = *estimated_errors(coarse_model(8), some_result(), companion).v_out;
  companion.vn_out_m_s += 0.1;
  const double both = *estimated_errors(coarse_model(8), some_result(), companion).v_out;
  const double tolerance = coarse_model().tolerance;
  EXPECT_NEAR((both - tolerance) / (one - tolerance), std::sqrt(2.0), 1e-9);
}

TEST(EstimatedErrors, OfTheSlideAreAFractionOfTheSlideItself) {
  CaseResult companion = some_result();
  companion.slide_m *= 1.03;
  const double error = *estimated_errors(coarse_model(64), some_result(), companion).slide;
  // If both meshes resolve the waves, the estimate is a third of the difference (order 2).
  EXPECT_NEAR(error - coarse_model().tolerance, 0.01, 1e-5);
}

TEST(EstimatedErrors, AreAbsentIfTheScaleIsZero) {
  CaseResult result = some_result();
  result.fn_peak_N = 0.0;
  const ErrorEstimate errors = estimated_errors(coarse_model(4), result, some_result());
  EXPECT_FALSE(errors.fn_peak);
  EXPECT_FALSE(errors.ft_peak);
  EXPECT_TRUE(errors.duration);
}

TEST(EstimatedErrors, ContainTheToleranceOfChosenSteps) {
  CaseResult companion = some_result();
  companion.duration_s *= 1.0 + 1e-12;
  ModelParameters model = coarse_model(64);
  EXPECT_NEAR(*estimated_errors(model, some_result(), companion).duration, model.tolerance, 1e-11);
  model.dt_s = 1e-7;
  EXPECT_LT(*estimated_errors(model, some_result(), companion).duration, 1e-11);
}

TEST(EstimatedErrors, TwiceTheEstimateBoundsTheDifferenceToAFinerMesh) {
  const ModelParameters model = soft_model(2);
  const Finger finger(model);
  const Finger companion(companion_model(model));
  const Finger finer(soft_model(4));
  int held = 0;
  int judged = 0;
  const auto judge = [&](const std::optional<double>& estimate, double truth) {
    held += std::abs(truth) <= 2.0 * *estimate + 1e-9 ? 1 : 0;
    ++judged;
  };
  for (const double H_m : {0.4, 0.7, 1.0}) {
    for (const double mu : {0.3, 1.3}) {
      for (const double e_star : {0.6, 1.0}) {
        const CaseResult result = finger.solve(H_m, mu, e_star);
        const CaseResult truth = finer.solve(H_m, mu, e_star);
        const ErrorEstimate errors =
            estimated_errors(model, result, companion.solve(H_m, mu, e_star));
        judge(errors.fn_peak, (result.fn_peak_N - truth.fn_peak_N) / result.fn_peak_N);
        judge(errors.duration, (result.duration_s - truth.duration_s) / result.duration_s);
        judge(errors.impulse_n, (result.impulse_n_Ns - truth.impulse_n_Ns) / result.impulse_n_Ns);
      }
    }
  }
  EXPECT_GE(held, judged * 9 / 10) << "of " << judged;
}

using Outcomes = std::map<std::uint64_t, Outcome>;

/// Returns the outcomes by point number. Expects that each point is requested and answered exactly
/// once.
Outcomes solved_with_errors(const std::vector<FingerPoint>& points, FallCache& falls) {
  Outcomes outcomes;
  std::size_t next = 0;
  solve_points_with_errors(
      [&] { return next < points.size() ? std::optional(points[next++]) : std::nullopt; }, falls,
      [&](Outcome&& outcome) {
        EXPECT_TRUE(outcomes.emplace(outcome.number, std::move(outcome)).second);
      });
  EXPECT_EQ(outcomes.size(), points.size());
  return outcomes;
}

/// Returns points of several models with two elements per link. The points are too many to be
/// solved together. No model reaches H = 1.1999 m.
std::vector<FingerPoint> solvable_and_other_points() {
  std::vector<ModelParameters> models(3, coarse_model(2));
  models[1].k_N_m *= 0.5;
  models[2].E_Pa *= 0.9;
  const auto falls = solve_falls(models);
  std::vector<FingerPoint> points;
  for (std::size_t i = 0; i < models.size(); ++i) {
    const Finger finger(models[i], falls[i].fallen);
    for (const double H_m : {0.5, 1.0, 1.1999}) {
      for (int j = 0; j < 30; ++j) {
        points.push_back({finger, 1000 + points.size(), {H_m, 0.05 * j, 0.8}});
      }
    }
  }
  return points;
}

const std::vector<FingerPoint>& mixed_points() {
  static const auto points = solvable_and_other_points();
  return points;
}

const Outcomes& mixed_outcomes() {
  FallCache falls;
  static const Outcomes outcomes = solved_with_errors(mixed_points(), falls);
  return outcomes;
}

TEST(SolvedWithErrors, AllOtherOutputsHaveTheSameBitsAsWithoutErrors) {
  const auto& points = mixed_points();
  int estimated = 0;
  std::size_t next = 0;
  solve_points([&] { return next < points.size() ? std::optional(points[next++]) : std::nullopt; },
               [&](Outcome&& without) {
                 Outcome with = mixed_outcomes().at(without.number);
                 EXPECT_EQ(with.error, without.error);
                 ASSERT_EQ(with.result.has_value(), without.result.has_value());
                 if (with.result) {
                   estimated += with.result->errors.mode_same ? 1 : 0;
                   with.result->errors = {};
                   expect_same_bits(*with.result, *without.result);
                 }
               });
  EXPECT_EQ(estimated, 180) << "all points except those that are never reached";
}

TEST(SolvedWithErrors, EstimatesEqualThoseOfThePointSolvedAlone) {
  for (const std::size_t i : {0U, 95U, 239U}) {
    const auto& [finger, number, request] = mixed_points()[i];
    const Finger companion(companion_model(finger.model()));
    EXPECT_EQ(mixed_outcomes().at(number).result->errors,
              estimated_errors(finger.model(), finger.solve(request.H_m, request.mu, 0.8),
                               companion.solve(request.H_m, request.mu, 0.8)));
  }
}

TEST(SolvedWithErrors, IfTheCompanionFailsThePointIsSolvedWithoutErrors) {
  FallCache falls(std::size_t{1} << 20, [](auto models) {
    return std::vector<FallOutcome>(models.size(), FallOutcome{nullptr, "no fall today"});
  });
  const Outcomes outcomes = solved_with_errors({mixed_points().front()}, falls);
  EXPECT_TRUE(outcomes.at(1000).result);
  EXPECT_EQ(outcomes.at(1000).result->errors, ErrorEstimate{});
}

TEST(SolvedWithErrors, FrictionlessAndInelasticContactsHaveErrorsToo) {
  for (const Integrator integrator : {Integrator::kExplicit, Integrator::kGeneralizedAlpha}) {
    ModelParameters model = coarse_model(2);
    model.integrator = integrator;
    model.dt_fall_s = integrator == Integrator::kExplicit ? 0.0 : 1e-4;
    const Finger finger(model);
    FallCache falls;
    const Outcomes outcomes =
        solved_with_errors({{finger, 0, {0.9, 0.0, 0.05}}, {finger, 1, {0.9, 3.0, 0.01}}}, falls);
    EXPECT_EQ(outcomes.at(0).result->errors.ft_peak, 0.0);
    EXPECT_EQ(outcomes.at(0).result->errors.stick_total, 0.0);
    for (const auto& [number, outcome] : outcomes) {
      EXPECT_GT(outcome.result->errors.duration, 0.0);
      EXPECT_TRUE(is_finite(*outcome.result));
    }
  }
}

}  // namespace
}  // namespace oblique::solver
