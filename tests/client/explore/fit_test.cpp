#include "client/explore/fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Core>
#include <Eigen/LU>

#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using Eigen::VectorXd;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Returns a fit problem whose predictions are given by the formula `model`.
template <class Model>
FitProblem problem_of(std::vector<Unknown> unknowns, const VectorXd& measured, double sd,
                      Model model) {
  FitProblem problem{
      std::move(unknowns), measured, VectorXd::Constant(measured.size(), sd), {}, {}};
  for (Eigen::Index i = 0; i < measured.size(); ++i) {
    problem.names.push_back("number " + std::to_string(i));
  }
  problem.evaluate = [model](const std::vector<VectorXd>& points, const std::string& /*what*/) {
    std::vector<VectorXd> predictions;
    for (const VectorXd& point : points) {
      predictions.push_back(model(point));
    }
    return predictions;
  };
  return problem;
}

/// The straight line y_i = a + b t_i with t = 0, 1, 2, 3 and sd 0.5. Its covariance is
/// var a = sd^2 sum t^2 / D, var b = sd^2 n / D, cov = -sd^2 sum t / D, D = n sum t^2 - (sum t)^2.
FitProblem line_problem() {
  const VectorXd measured{{1.0, 2.5, 2.0, 4.0}};
  return problem_of(
      {{"a", -10.0, 10.0, 3.0}, {"b", -5.0, 5.0, -1.0}}, measured, 0.5, [](const VectorXd& p) {
        return VectorXd((p[0] + p[1] * Eigen::ArrayXd::LinSpaced(4, 0.0, 3.0)).matrix());
      });
}

VectorXd decay(const VectorXd& p) {
  return (p[0] * (-p[1] * Eigen::ArrayXd::LinSpaced(12, 0.0, 3.0)).exp()).matrix();
}

FitProblem decay_problem(double sd) {
  VectorXd truth(2);
  truth << 3.0, 0.8;
  VectorXd measured = decay(truth);
  for (Eigen::Index i = 0; i < measured.size(); ++i) {
    measured[i] += (i % 2 == 0 ? 0.5 : -0.5) * sd;
  }
  return problem_of({{"a", 0.1, 100.0, 3.16}, {"rate", 0.01, 10.0, 0.1}}, measured, sd, decay);
}

TEST(Unknown, RunsThroughItsRangeWithTheAngleAndStaysWithin) {
  for (const Unknown& unknown : {Unknown{"k", 1e7, 1e8, 2e7}, Unknown{"x", -2.0, 3.0, 0.0}}) {
    EXPECT_DOUBLE_EQ(unknown.value_at(M_PI), unknown.from);
    EXPECT_DOUBLE_EQ(unknown.value_at(2.0 * M_PI), unknown.to);
    EXPECT_NEAR(unknown.value_at(unknown.angle_of(unknown.start)), unknown.start,
                1e-12 * unknown.to);
    for (double w = 0.0; w < 10.0; w += 0.1) {
      EXPECT_GE(unknown.value_at(w), unknown.from);
      EXPECT_LE(unknown.value_at(w), unknown.to);
    }
  }
  EXPECT_DOUBLE_EQ((Unknown{"k", 1e6, 1e8, 2e7}.value_at(1.5 * M_PI)), 1e7);
  // The cosine has a rounding error of 2e-16. `value_at` multiplies it by 3, half of the range.
  EXPECT_NEAR((Unknown{"x", -2.0, 4.0, 0.0}.value_at(1.5 * M_PI)), 1.0, 1e-14);
}

TEST(Fit, OfAStraightLineHasTheCovarianceOfLinearRegression) {
  const Fit found = fit(line_problem());
  // Normal equations: n = 4, sum t = 6, sum t^2 = 14, D = 20, sum y = 9.5, sum t y = 18.5.
  const double a = (9.5 * 14.0 - 18.5 * 6.0) / 20.0;
  const double b = (4.0 * 18.5 - 6.0 * 9.5) / 20.0;
  const double sd_a = 0.5 * std::sqrt(14.0 / 20.0);
  const double sd_b = 0.5 * std::sqrt(4.0 / 20.0);
  EXPECT_NEAR(found.unknowns[0].estimate.value, a, 2e-3 * sd_a);
  EXPECT_NEAR(found.unknowns[1].estimate.value, b, 2e-3 * sd_b);
  EXPECT_NEAR(found.unknowns[0].sd, sd_a, 1e-4);
  EXPECT_NEAR(found.unknowns[1].sd, sd_b, 1e-4);
  EXPECT_NEAR(found.correlation(0, 1), -6.0 / std::sqrt(14.0 * 4.0), 1e-4);
  EXPECT_EQ(found.degrees_of_freedom, 2U);
  // For a linear problem the profile of chi2 is the parabola that the covariance gives.
  EXPECT_NEAR(found.unknowns[0].estimate.from, a - 1.95996 * sd_a, 0.01 * sd_a);
  EXPECT_NEAR(found.unknowns[1].estimate.to, b + 1.95996 * sd_b, 0.01 * sd_b);
  EXPECT_THAT(found.combinations, IsEmpty());
}

TEST(Fit, ScalesDeviationsAndIntervalsByChi2WhereAsked) {
  const Fit plain = fit(line_problem());
  const Fit scaled = fit(line_problem(), true);
  const double factor = std::sqrt(plain.minimum.chi2 / 2.0);
  EXPECT_NEAR(scaled.scale, factor * factor, 1e-9);
  // The 97.5 % quantile of Student's t with two degrees of freedom is 4.3027, the normal one 1.96.
  const double wider = factor * 4.3027 / 1.95996;
  for (const std::size_t i : {0U, 1U}) {
    EXPECT_NEAR(scaled.unknowns[i].sd, factor * plain.unknowns[i].sd, 1e-6);
    EXPECT_NEAR(scaled.unknowns[i].estimate.to - scaled.unknowns[i].estimate.value,
                wider * (plain.unknowns[i].estimate.to - plain.unknowns[i].estimate.value), 0.02);
  }
}

TEST(Fit, OfADecayAgreesWithTheCovarianceOfItsDerivatives) {
  const Fit found = fit(decay_problem(0.01));
  // Analytic Jacobian of a exp(-rate t), divided by the sd.
  const auto t = Eigen::ArrayXd::LinSpaced(12, 0.0, 3.0);
  const double a = found.unknowns[0].estimate.value;
  Eigen::MatrixXd jacobian(12, 2);
  jacobian.col(0) = (-found.unknowns[1].estimate.value * t).exp() / 0.01;
  jacobian.col(1) = -a * t * (-found.unknowns[1].estimate.value * t).exp() / 0.01;
  const Eigen::Matrix2d covariance = (jacobian.transpose() * jacobian).inverse();
  EXPECT_NEAR(found.unknowns[0].sd, std::sqrt(covariance(0, 0)), 1e-3 * found.unknowns[0].sd);
  EXPECT_NEAR(found.unknowns[1].sd, std::sqrt(covariance(1, 1)), 1e-3 * found.unknowns[1].sd);
  EXPECT_NEAR(a, 3.0, found.unknowns[0].sd);
  EXPECT_NEAR(found.unknowns[1].estimate.value, 0.8, found.unknowns[1].sd);
}

TEST(Minimise, FindsTheMinimumOfRosenbrocksFunction) {
  const auto problem = problem_of({{"x", -2.0, 2.0, -1.2}, {"y", -1.0, 3.0, 1.0}},
                                  VectorXd::Zero(2), 1.0, [](const VectorXd& p) {
                                    return VectorXd{{10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]}};
                                  });
  const auto minimum = minimise(problem, problem.start(), 1e-12);
  EXPECT_NEAR(minimum.parameters[0], 1.0, 1e-5);
  EXPECT_NEAR(minimum.parameters[1], 1.0, 1e-5);
  EXPECT_LT(minimum.iteration, 60);
}

TEST(Fit, KeepsAnUnknownAtABoundBehindWhichTheMinimumIs) {
  auto problem = line_problem();
  problem.unknowns[1] = {"b", 1.5, 5.0, 2.0};  // without the bound, b would be 0.85
  const Fit found = fit(problem);
  EXPECT_TRUE(found.unknowns[1].is_at_bound);
  EXPECT_NEAR(found.unknowns[1].estimate.value, 1.5, 1e-3);
  EXPECT_TRUE(std::isnan(found.unknowns[1].sd));
  EXPECT_TRUE(std::isnan(found.unknowns[1].estimate.from));
  // At b = 1.5, a is the mean of y - 1.5 t; its sd is 0.5 / sqrt(4).
  EXPECT_NEAR(found.unknowns[0].estimate.value, (9.5 - 9.0) / 4.0, 2e-3);
  EXPECT_NEAR(found.unknowns[0].sd, 0.25, 1e-3);
  // The profile over b is a parabola around 0.85. The interval ends where the profile is 3.84
  // higher than at b = 1.5.
  const double variance = 0.25 * 4.0 / 20.0;
  const double end = 0.85 + std::sqrt((1.5 - 0.85) * (1.5 - 0.85) + 3.84 * variance);
  EXPECT_NEAR(found.unknowns[1].estimate.to, end, 0.01);
}

// A line through normal noise of the standard deviation 0.2, which the fit takes for 0.5. Of 400
// intervals of 95 %, 380 are expected to cover the slope with a standard deviation of 4.4; with the
// normal quantile instead of Student's, 325.
TEST(Fit, ScaledIntervalsOfFewNumbersCoverTheTruthAsOftenAsTheySay) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.0, 0.2);
  auto problem = line_problem();
  int covered = 0;
  for (int i = 0; i < 400; ++i) {
    for (Eigen::Index t = 0; t < problem.measured.size(); ++t) {
      problem.measured[t] = 1.0 + 0.5 * static_cast<double>(t) + normal(random);
    }
    const auto slope = fit(problem, true).unknowns[1].estimate;
    covered += slope.from <= 0.5 && 0.5 <= slope.to ? 1 : 0;
  }
  EXPECT_NEAR(covered, 380, 22);
}

TEST(Fit, CountsAnUnknownAtABoundAsADegreeOfFreedom) {
  auto problem = line_problem();
  problem.unknowns[1] = {"b", 1.5, 5.0, 2.0};
  const Fit found = fit(problem, true);
  EXPECT_EQ(found.degrees_of_freedom, 3U);
  EXPECT_NEAR(found.scale, found.minimum.chi2 / 3.0, 1e-12);
}

TEST(Fit, JudgesTheEffectOfAnUnknownAtEitherBoundByAStepInwards) {
  for (const auto& [from, to] : {std::pair{1.5, 5.0}, {-5.0, 0.2}}) {
    auto problem = line_problem();  // without the bound, b would be 0.85
    problem.unknowns[1] = {"b", from, to, (from + to) / 2.0};
    problem.unknowns.push_back({"unused", 0.0, 1.0, 0.5});
    const Fit found = fit(problem);
    EXPECT_TRUE(found.unknowns[1].is_at_bound) << from;
    EXPECT_TRUE(found.unknowns[1].has_effect) << from;
    EXPECT_FALSE(found.unknowns[2].has_effect) << from;
  }
}

// chi2 sd^2 = 0.19 (a - 0.9)^2 + (b - 1.8 - 0.9 (a - 1))^2 with b >= 2. It is least at a = 1.161
// and the bound of b, where derivatives with respect to the angle of b vanish. From a = 1.222 on,
// the best b lies within the bounds, and chi2 sd^2 is 0.19 (a - 0.9)^2.
TEST(Fit, ProfilesOverAnotherUnknownThatLeavesItsBound) {
  const double sd = 0.2;
  const auto problem = problem_of(
      {{"a", 1.0, 10.0, 3.0}, {"b", 2.0, 10.0, 4.0}}, VectorXd::Zero(2), sd, [](const VectorXd& p) {
        return VectorXd{{std::sqrt(0.19) * (p[0] - 0.9), p[1] - 1.8 - 0.9 * (p[0] - 1.0)}};
      });
  const Fit found = fit(problem);
  EXPECT_TRUE(found.unknowns[1].is_at_bound);
  EXPECT_NEAR(found.unknowns[0].estimate.value, 1.161, 1e-3);
  const double at_end = found.minimum.chi2 * sd * sd + 3.8415 * sd * sd;
  EXPECT_NEAR(found.unknowns[0].estimate.to, 0.9 + std::sqrt(at_end / 0.19), 0.01);
}

TEST(Fit, NamesUnknownsOfWhichOnlyTheProductIsDetermined) {
  const auto problem = problem_of(
      {{"a", 0.1, 10.0, 0.5}, {"b", 0.1, 10.0, 2.0}, {"c", -1.0, 1.0, 0.1}},
      VectorXd{{2.0, 4.1, 6.0, 8.1}}, 0.1, [](const VectorXd& p) {
        return VectorXd((p[0] * p[1] * Eigen::ArrayXd::LinSpaced(4, 1.0, 4.0) + p[2]).matrix());
      });
  const Fit found = fit(problem);
  ASSERT_EQ(found.combinations.size(), 1U);
  EXPECT_THAT(found.combinations[0].unknowns, ElementsAre(0U, 1U));
  EXPECT_TRUE(found.combinations[0].is_undetermined);
  EXPECT_NEAR(found.correlation(0, 1), -1.0, 1e-3);
  EXPECT_TRUE(std::isnan(found.unknowns[0].sd));
  EXPECT_FALSE(std::isnan(found.unknowns[2].sd));
  EXPECT_NEAR(found.unknowns[0].estimate.value * found.unknowns[1].estimate.value, 2.02, 0.05);
  // The product a b is about 2 and b is at most 10, so a is at least 0.2. The interval of a has no
  // upper end, because it reaches the upper bound of a.
  EXPECT_NEAR(found.unknowns[0].estimate.from, 0.2, 0.02);
  EXPECT_TRUE(std::isnan(found.unknowns[0].estimate.to));
}

TEST(Fit, NamesAnUnknownThatChangesNothing) {
  auto problem = line_problem();
  problem.unknowns.push_back({"unused", 0.0, 1.0, 0.5});
  const Fit found = fit(problem);
  EXPECT_FALSE(found.unknowns[2].has_effect);
  EXPECT_TRUE(found.unknowns[1].has_effect);
  EXPECT_TRUE(std::isnan(found.unknowns[2].sd));
  EXPECT_TRUE(std::isnan(found.unknowns[2].estimate.from));
  EXPECT_TRUE(std::isnan(found.unknowns[2].estimate.to));
  EXPECT_NEAR(found.unknowns[1].estimate.value, 0.85, 1e-3);
}

TEST(Fit, NamesAPairThatIsNearlyEquivalent) {
  const auto problem =
      problem_of({{"a", -10.0, 10.0, 1.0}, {"b", -10.0, 10.0, 1.0}}, VectorXd{{3.0, 3.2, 3.1}}, 0.1,
                 [](const VectorXd& p) {
                   return VectorXd{{p[0] + p[1], p[0] + 1.05 * p[1], p[0] + 1.1 * p[1]}};
                 });
  const Fit found = fit(problem);
  ASSERT_EQ(found.combinations.size(), 1U);
  EXPECT_THAT(found.combinations[0].unknowns, ElementsAre(0U, 1U));
  EXPECT_FALSE(found.combinations[0].is_undetermined);
  EXPECT_FALSE(std::isnan(found.unknowns[0].sd));
  EXPECT_LT(found.correlation(0, 1), -0.99);
}

TEST(Fit, HasAsymmetricIntervalsWhereTheModelIsCurved) {
  // chi2 = ((x^2 - 1) / 0.5)^2 is 0 at x = 1 and 3.84 at x^2 = 1 -+ 0.98.
  const auto problem = problem_of({{"x", 0.01, 10.0, 3.0}}, VectorXd{{1.0}}, 0.5,
                                  [](const VectorXd& p) { return VectorXd{{p[0] * p[0]}}; });
  const Fit found = fit(problem);
  EXPECT_NEAR(found.unknowns[0].estimate.value, 1.0, 1e-3);
  EXPECT_NEAR(found.unknowns[0].estimate.from, std::sqrt(1.0 - 0.97998), 0.01);
  EXPECT_NEAR(found.unknowns[0].estimate.to, std::sqrt(1.0 + 0.97998), 0.003);
}

TEST(Fit, EndsAnIntervalWhereTheModelLacksAMeasuredOutput) {
  const auto problem =
      problem_of({{"x", 0.0, 10.0, 3.0}}, VectorXd{{2.0}}, 1.0, [](const VectorXd& p) {
        return VectorXd{{p[0] < 1.0 ? std::numeric_limits<double>::quiet_NaN() : p[0]}};
      });
  const Fit found = fit(problem);
  EXPECT_NEAR(found.unknowns[0].estimate.value, 2.0, 1e-3);
  EXPECT_NEAR(found.unknowns[0].estimate.from, 1.0, 1e-2);
  EXPECT_TRUE(found.unknowns[0].is_cut);
  EXPECT_NEAR(found.unknowns[0].estimate.to, 3.96, 0.01);
}

TEST(Fit, StartsAgainWhereAProfileFindsASmallerChi2) {
  // chi2 has minima near x = -1 (about 0.09) and at x = 1.5 (0). Between them it rises to 0.36.
  const auto problem =
      problem_of({{"x", -4.0, 4.0, -1.2}}, VectorXd::Zero(2), 1.0, [](const VectorXd& p) {
        return VectorXd{{0.338 * (p[0] + 1.0) * (p[0] - 1.5), 0.12 * (p[0] - 1.5)}};
      });
  EXPECT_NEAR(minimise(problem, problem.start()).parameters[0], -0.95, 0.05);
  const Fit found = fit(problem);
  EXPECT_NEAR(found.minimum.parameters[0], 1.5, 0.01);
  EXPECT_LT(found.minimum.chi2, 1e-4);
}

TEST(Fit, EndsAnIntervalWhereChi2JumpsOverTheLimit) {
  const auto problem =
      problem_of({{"x", 0.0, 10.0, 3.0}}, VectorXd{{2.0}}, 1.0,
                 [](const VectorXd& p) { return VectorXd{{p[0] < 3.0 ? p[0] : p[0] + 4.0}}; });
  const Fit found = fit(problem);
  EXPECT_NEAR(found.unknowns[0].estimate.to, 3.0, 1e-2);
  EXPECT_NEAR(found.unknowns[0].estimate.from, 0.04, 0.01);
  EXPECT_TRUE(found.unknowns[0].is_cut);
  EXPECT_FALSE(fit(line_problem()).unknowns[0].is_cut);
}

TEST(Fit, ReachesTheLeastOfSeveralMinimaFromAWrongStart) {
  // chi2 has many local minima as a function of the frequency w.
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(20, 0.0, 1.0);
  const auto model = [t](const VectorXd& p) { return VectorXd((p[0] * t).sin().matrix()); };
  const auto problem = problem_of({{"w", 0.0, 50.0, 1.5}}, model(VectorXd{{25.0}}), 0.1, model);
  EXPECT_GT(minimise(problem, problem.start()).chi2, 100.0);
  EXPECT_NEAR(fit(problem).minimum.parameters[0], 25.0, 1e-3);
}

TEST(Fit, SearchesAllEndsSideBySide) {
  auto problem = line_problem();
  std::vector<std::size_t> sizes;
  problem.evaluate = [&sizes, evaluate = problem.evaluate](const std::vector<VectorXd>& points,
                                                           const std::string& what) {
    sizes.push_back(points.size());
    return evaluate(points, what);
  };
  // With two unknowns an iteration evaluates a point and four finite differences: 5 points. The fit
  // begins with 16 places and finally searches four interval ends (20 points).
  const auto iterations = static_cast<std::size_t>(minimise(problem, problem.start()).iteration);
  EXPECT_THAT(sizes, testing::Each(5U));
  EXPECT_LE(sizes.size(), iterations + 2);
  sizes.clear();
  fit(problem);
  EXPECT_EQ(sizes.front(), 16U);
  EXPECT_EQ(std::ranges::count(sizes, 20U), 2);
  EXPECT_LE(sizes.size(), iterations + 12);
}

std::string objection_to(const FitProblem& problem) {
  try {
    fit(problem);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(Fit, RefusesProblemsThatHaveNoAnswer) {
  auto problem = line_problem();
  problem.unknowns[0].start = -10.0;
  EXPECT_THAT(objection_to(problem), HasSubstr("-10 to 10 with the start -10: the bounds must"));
  problem = line_problem();
  std::swap(problem.unknowns[0].from, problem.unknowns[0].to);
  EXPECT_THAT(objection_to(problem), HasSubstr("10 to -10 with the start 3: the bounds must rise"));
  problem = line_problem();
  problem.unknowns.resize(5, {"c", 0.0, 1.0, 0.5});
  EXPECT_THAT(objection_to(problem), HasSubstr("5 unknowns cannot be determined by 4 measured"));
  problem = line_problem();
  problem.unknowns.clear();
  EXPECT_THAT(objection_to(problem), HasSubstr("0 unknowns cannot be determined"));
  problem = line_problem();
  problem.evaluate = [](const std::vector<VectorXd>& points, const std::string& /*what*/) {
    VectorXd predictions = VectorXd::Zero(4);
    predictions[3] = std::numeric_limits<double>::quiet_NaN();
    return std::vector<VectorXd>(points.size(), predictions);
  };
  EXPECT_THAT(objection_to(problem),
              HasSubstr("number 3: the model has no such output at the start"));
}

}  // namespace
}  // namespace oblique::client
