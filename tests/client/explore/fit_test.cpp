#include "client/explore/fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
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

/// A problem of closed-form predictions.
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

/// y_i = a + b t_i at t = 0, 1, 2, 3 with sd 0.5. Covariance of a straight line:
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
  return problem_of(
      {{"a", 0.1, 100.0, Unknown::usual_start(0.1, 100.0)}, {"rate", 0.01, 10.0, 0.1}}, measured,
      sd, decay);
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
      const double difference = (unknown.value_at(w + 1e-5) - unknown.value_at(w - 1e-5)) / 2e-5;
      EXPECT_NEAR(unknown.slope_at(w), difference, 1e-6 * unknown.to);
    }
  }
  EXPECT_DOUBLE_EQ(Unknown::usual_start(1e6, 1e8), 1e7);
  EXPECT_DOUBLE_EQ(Unknown::usual_start(-2.0, 4.0), 1.0);
}

TEST(Fit, OfAStraightLineHasTheCovarianceOfLinearRegression) {
  const Fit found = fit(line_problem());
  // Normal equations: n = 4, sum t = 6, sum t^2 = 14, D = 20, sum y = 9.5, sum t y = 18.5.
  const double a = (9.5 * 14.0 - 18.5 * 6.0) / 20.0;
  const double b = (4.0 * 18.5 - 6.0 * 9.5) / 20.0;
  const double sd_a = 0.5 * std::sqrt(14.0 / 20.0);
  const double sd_b = 0.5 * std::sqrt(4.0 / 20.0);
  EXPECT_NEAR(found.estimates[0].value, a, 2e-3 * sd_a);
  EXPECT_NEAR(found.estimates[1].value, b, 2e-3 * sd_b);
  EXPECT_NEAR(found.estimates[0].sd.value(), sd_a, 1e-4);
  EXPECT_NEAR(found.estimates[1].sd.value(), sd_b, 1e-4);
  EXPECT_NEAR(found.correlation(0, 1), -6.0 / std::sqrt(14.0 * 4.0), 1e-4);
  EXPECT_EQ(found.degrees_of_freedom, 2U);
  // The profile of a linear problem is the parabola given by the covariance.
  EXPECT_NEAR(found.estimates[0].lower.value(), a - 1.95996 * sd_a, 0.01 * sd_a);
  EXPECT_NEAR(found.estimates[1].upper.value(), b + 1.95996 * sd_b, 0.01 * sd_b);
  EXPECT_THAT(found.inseparable, IsEmpty());
  EXPECT_THAT(found.correlated, IsEmpty());
}

TEST(Fit, ScalesDeviationsAndIntervalsByChi2WhereAsked) {
  const Fit plain = fit(line_problem());
  const Fit scaled = fit(line_problem(), true);
  const double factor = std::sqrt(plain.minimum.chi2 / 2.0);
  EXPECT_NEAR(scaled.scale, factor * factor, 1e-9);
  for (const std::size_t i : {0U, 1U}) {
    EXPECT_NEAR(*scaled.estimates[i].sd, factor * *plain.estimates[i].sd, 1e-6);
    EXPECT_NEAR(*scaled.estimates[i].upper - scaled.estimates[i].value,
                factor * (*plain.estimates[i].upper - plain.estimates[i].value), 0.02);
  }
}

TEST(Fit, OfADecayAgreesWithTheCovarianceOfItsDerivatives) {
  const Fit found = fit(decay_problem(0.01));
  // J of a exp(-rate t) by hand.
  const auto t = Eigen::ArrayXd::LinSpaced(12, 0.0, 3.0);
  const double a = found.estimates[0].value;
  Eigen::MatrixXd jacobian(12, 2);
  jacobian.col(0) = (-found.estimates[1].value * t).exp() / 0.01;
  jacobian.col(1) = -a * t * (-found.estimates[1].value * t).exp() / 0.01;
  const Eigen::Matrix2d covariance = (jacobian.transpose() * jacobian).inverse();
  EXPECT_NEAR(*found.estimates[0].sd, std::sqrt(covariance(0, 0)), 1e-3 * *found.estimates[0].sd);
  EXPECT_NEAR(*found.estimates[1].sd, std::sqrt(covariance(1, 1)), 1e-3 * *found.estimates[1].sd);
  EXPECT_NEAR(a, 3.0, *found.estimates[0].sd);
  EXPECT_NEAR(found.estimates[1].value, 0.8, *found.estimates[1].sd);
}

TEST(Minimise, FindsTheMinimumOfRosenbrocksFunction) {
  const auto problem = problem_of({{"x", -2.0, 2.0, -1.2}, {"y", -1.0, 3.0, 1.0}},
                                  VectorXd::Zero(2), 1.0, [](const VectorXd& p) {
                                    return VectorXd{{10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]}};
                                  });
  std::vector<double> chi2;
  const auto minimum =
      minimise(problem, 1e-12, [&](const FitStep& step) { chi2.push_back(step.chi2); });
  EXPECT_NEAR(minimum.parameters[0], 1.0, 1e-5);
  EXPECT_NEAR(minimum.parameters[1], 1.0, 1e-5);
  EXPECT_TRUE(std::is_sorted(chi2.rbegin(), chi2.rend()));
  EXPECT_LT(minimum.iteration, 60);
}

TEST(Fit, KeepsAnUnknownAtABoundBehindWhichTheMinimumIs) {
  auto problem = line_problem();
  problem.unknowns[1] = {"b", 1.5, 5.0, 2.0};  // without the bound: 0.85
  const Fit found = fit(problem);
  EXPECT_TRUE(found.estimates[1].is_at_bound);
  EXPECT_NEAR(found.estimates[1].value, 1.5, 1e-3);
  EXPECT_FALSE(found.estimates[1].sd);
  EXPECT_FALSE(found.estimates[1].lower);
  // With b = 1.5 a is the mean of y - 1.5 t, with sd 0.5 / sqrt(4).
  EXPECT_NEAR(found.estimates[0].value, (9.5 - 9.0) / 4.0, 2e-3);
  EXPECT_NEAR(*found.estimates[0].sd, 0.25, 1e-3);
  // The profile over b is the parabola around 0.85; its end is where it has risen by 3.84
  // since 1.5.
  const double variance = 0.25 * 4.0 / 20.0;
  const double end = 0.85 + std::sqrt((1.5 - 0.85) * (1.5 - 0.85) + 3.84 * variance);
  EXPECT_NEAR(found.estimates[1].upper.value(), end, 0.01);
}

TEST(Fit, SaysWhichUnknownsOnlyTheirProductDetermines) {
  const auto problem = problem_of(
      {{"a", 0.1, 10.0, 0.5}, {"b", 0.1, 10.0, 2.0}, {"c", -1.0, 1.0, 0.1}},
      VectorXd{{2.0, 4.1, 6.0, 8.1}}, 0.1, [](const VectorXd& p) {
        return VectorXd((p[0] * p[1] * Eigen::ArrayXd::LinSpaced(4, 1.0, 4.0) + p[2]).matrix());
      });
  const Fit found = fit(problem);
  EXPECT_THAT(found.inseparable, ElementsAre(ElementsAre(0U, 1U)));
  EXPECT_NEAR(found.correlation(0, 1), -1.0, 1e-3);
  EXPECT_FALSE(found.estimates[0].sd);
  EXPECT_TRUE(found.estimates[2].sd);
  EXPECT_NEAR(found.estimates[0].value * found.estimates[1].value, 2.02, 0.05);
  // a b is about 2, and b at most 10: a is at least 0.2, and no upper end is within its bound.
  EXPECT_NEAR(found.estimates[0].lower.value(), 0.2, 0.02);
  EXPECT_FALSE(found.estimates[0].upper);
}

TEST(Fit, SaysWhichUnknownChangesNothing) {
  auto problem = line_problem();
  problem.unknowns.push_back({"unused", 0.0, 1.0, 0.5});
  const Fit found = fit(problem);
  EXPECT_THAT(found.without_effect, ElementsAre(2U));
  EXPECT_FALSE(found.estimates[2].sd);
  EXPECT_FALSE(found.estimates[2].lower);
  EXPECT_FALSE(found.estimates[2].upper);
  EXPECT_NEAR(found.estimates[1].value, 0.85, 1e-3);
}

TEST(Fit, SaysWhichPairIsNearlyTheSame) {
  const auto problem =
      problem_of({{"a", -10.0, 10.0, 1.0}, {"b", -10.0, 10.0, 1.0}}, VectorXd{{3.0, 3.2, 3.1}}, 0.1,
                 [](const VectorXd& p) {
                   return VectorXd{{p[0] + p[1], p[0] + 1.05 * p[1], p[0] + 1.1 * p[1]}};
                 });
  const Fit found = fit(problem);
  ASSERT_EQ(found.correlated.size(), 1U);
  EXPECT_LT(found.correlation(0, 1), -0.99);
  EXPECT_THAT(found.inseparable, IsEmpty());
}

TEST(Fit, HasAsymmetricIntervalsWhereTheModelIsCurved) {
  // chi2 = ((x^2 - 1) / 0.5)^2 rises by 3.84 where x^2 = 1 -+ 0.98.
  const auto problem = problem_of({{"x", 0.01, 10.0, 3.0}}, VectorXd{{1.0}}, 0.5,
                                  [](const VectorXd& p) { return VectorXd{{p[0] * p[0]}}; });
  const Fit found = fit(problem);
  EXPECT_NEAR(found.estimates[0].value, 1.0, 1e-3);
  EXPECT_NEAR(found.estimates[0].lower.value(), std::sqrt(1.0 - 0.97998), 0.01);
  EXPECT_NEAR(found.estimates[0].upper.value(), std::sqrt(1.0 + 0.97998), 0.003);
}

TEST(Fit, EndsAnIntervalWhereTheModelLacksAMeasuredOutput) {
  const auto problem =
      problem_of({{"x", 0.0, 10.0, 3.0}}, VectorXd{{2.0}}, 1.0, [](const VectorXd& p) {
        return VectorXd{{p[0] < 1.0 ? std::numeric_limits<double>::quiet_NaN() : p[0]}};
      });
  const Fit found = fit(problem);
  EXPECT_NEAR(found.estimates[0].value, 2.0, 1e-3);
  EXPECT_NEAR(found.estimates[0].lower.value(), 1.0, 1e-2);
  EXPECT_NEAR(found.estimates[0].upper.value(), 3.96, 0.01);
}

TEST(Fit, StartsAgainWhereAProfileFindsASmallerChi2) {
  // Minima near x = -1, where chi2 is about 0.09, and at x = 1.5, where it is 0; 0.36 between them.
  const auto problem =
      problem_of({{"x", -4.0, 4.0, -1.2}}, VectorXd::Zero(2), 1.0, [](const VectorXd& p) {
        return VectorXd{{0.338 * (p[0] + 1.0) * (p[0] - 1.5), 0.12 * (p[0] - 1.5)}};
      });
  EXPECT_NEAR(minimise(problem).parameters[0], -0.95, 0.05);
  const Fit found = fit(problem);
  EXPECT_NEAR(found.minimum.parameters[0], 1.5, 0.01);
  EXPECT_LT(found.minimum.chi2, 1e-4);
}

TEST(Fit, AsksForThePointAndAllDisturbedOnesAtOnce) {
  auto problem = line_problem();
  std::vector<std::size_t> sizes;
  problem.evaluate = [&sizes, evaluate = problem.evaluate](const std::vector<VectorXd>& points,
                                                           const std::string& what) {
    sizes.push_back(points.size());
    return evaluate(points, what);
  };
  const auto minimum = minimise(problem);
  EXPECT_THAT(sizes, testing::Each(5U));
  EXPECT_LE(sizes.size(), static_cast<std::size_t>(minimum.iteration) + 2);
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
  EXPECT_THAT(objection_to(problem), HasSubstr("a = -10 to 10: the start -10 must be between"));
  problem = line_problem();
  std::swap(problem.unknowns[0].from, problem.unknowns[0].to);
  EXPECT_THAT(objection_to(problem), HasSubstr("a = 10 to -10: the lower bound must be below"));
  problem = line_problem();
  problem.sd[2] = 0.0;
  EXPECT_THAT(objection_to(problem), HasSubstr("number 2: the standard deviation 0 must be"));
  problem = line_problem();
  problem.unknowns.resize(5, {"c", 0.0, 1.0, 0.5});
  EXPECT_THAT(objection_to(problem), HasSubstr("5 unknowns cannot be determined by 4 measured"));
  problem = line_problem();
  problem.unknowns.clear();
  EXPECT_THAT(objection_to(problem), HasSubstr("at least one unknown"));
  problem = line_problem();
  problem.evaluate = [](const std::vector<VectorXd>& points, const std::string& /*what*/) {
    VectorXd predictions = VectorXd::Zero(4);
    predictions[3] = std::numeric_limits<double>::quiet_NaN();
    return std::vector<VectorXd>(points.size(), predictions);
  };
  EXPECT_THAT(objection_to(problem),
              HasSubstr("number 3: the model has no such output with a = 3"));
}

}  // namespace
}  // namespace oblique::client
