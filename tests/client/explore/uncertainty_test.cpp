#include "client/explore/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/recipe/sampling.h"

namespace oblique::client {
namespace {

/// Returns `n` random numbers in (0, 1).
std::vector<double> uniform_draws(std::size_t n, std::uint64_t seed) {
  protocol::Sample random;
  random.set_kind(protocol::SAMPLE_RANDOM);
  random.set_count(n);
  random.set_seed(seed);
  std::vector<double> draws;
  for (std::size_t i = 0; i < n; ++i) {
    draws.push_back(sampling::fraction(random, 0, i));
  }
  return draws;
}

std::vector<double> normal_draws(std::size_t n, std::uint64_t seed, double mean, double sd) {
  auto draws = uniform_draws(n, seed);
  for (double& draw : draws) {
    draw = mean + sd * sampling::normal_quantile(draw);
  }
  return draws;
}

bool covers(const Estimate& estimate, double truth) {
  return estimate.from <= truth && truth <= estimate.to;
}

// Of 2000 intervals of 95 %, 1900 are expected to cover the true value, with a standard deviation
// of 10. The tests allow six deviations.
constexpr int kIntervals = 2000;
constexpr double kExpected = 1900.0;
constexpr double kSlack = 60.0;

TEST(MeanTest, MeanAndDeviationAreThoseOfTheValues) {
  const std::vector<double> values{2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0};
  EXPECT_DOUBLE_EQ(mean_of(values).value, 5.0);
  EXPECT_DOUBLE_EQ(deviation_of(values), std::sqrt(32.0 / 7.0));
  EXPECT_NEAR(mean_of(values).half_width(), 2.364624 * std::sqrt(32.0 / 7.0 / 8.0), 1e-4);
  EXPECT_TRUE(std::isnan(mean_of({}).value));
  EXPECT_EQ(mean_of(std::vector<double>{3.0}).value, 3.0);
  EXPECT_TRUE(std::isnan(deviation_of(std::vector<double>{3.0})));
  EXPECT_TRUE(std::isnan(mean_of(std::vector<double>{3.0}).from));
}

// Published tables of Student's distribution.
TEST(MeanTest, TheQuantilesOfStudentsDistributionAreThoseOfTables) {
  for (const auto& [degrees, t] :
       std::vector<std::pair<std::uint64_t, double>>{{1, 12.7062},
                                                     {2, 4.30265},
                                                     {3, 3.18245},
                                                     {4, 2.77645},
                                                     {5, 2.57058},
                                                     {6, 2.44691},
                                                     {9, 2.26216},
                                                     {10, 2.22814},
                                                     {29, 2.04523},
                                                     {30, 2.04227},
                                                     {120, 1.97993},
                                                     {1'000, 1.96234},
                                                     {1'000'000, 1.95997}}) {
    EXPECT_NEAR(t_quantile(degrees), t, 1.1e-4 * t) << degrees;
  }
}

TEST(MeanTest, IntervalsCoverTheMeanOfNormalDrawsAsOftenAsTheySay) {
  for (const std::size_t n : {2U, 3U, 8U, 100U}) {
    int covered = 0;
    for (int i = 0; i < kIntervals; ++i) {
      const auto draws = normal_draws(n, static_cast<std::uint64_t>(i), 0.4, 0.05);
      covered += covers(mean_of(draws), 0.4) ? 1 : 0;
    }
    EXPECT_NEAR(covered, kExpected, kSlack) << n;
  }
}

TEST(QuantileTest, ItIsInterpolatedBetweenTheValuesAround) {
  const std::vector<double> rising{1.0, 2.0, 4.0, 8.0};
  EXPECT_DOUBLE_EQ(quantile_of(rising, 0.5).value, 3.0);
  EXPECT_DOUBLE_EQ(quantile_of(rising, 0.25).value, 1.75);
  EXPECT_TRUE(std::isnan(quantile_of({}, 0.5).value));
}

// According to tables of order statistics, the interval of the median of 20 values is from the 6th
// to the 15th value.
TEST(QuantileTest, ItsIntervalIsThatOfOrderStatistics) {
  std::vector<double> rising;
  for (int i = 1; i <= 20; ++i) {
    rising.push_back(i);
  }
  const auto median = quantile_of(rising, 0.5);
  EXPECT_EQ(median.from, 6.0);
  EXPECT_EQ(median.to, 15.0);
  const auto high = quantile_of(rising, 0.95);
  EXPECT_EQ(high.from, 17.0);
  EXPECT_TRUE(std::isnan(high.to)) << "twenty values have no upper bound for it: 0.95^20 > 0.025";
}

TEST(QuantileTest, IntervalsCoverTheQuantileOfAnyDistribution) {
  for (const double p : {0.05, 0.5, 0.9}) {
    int covered = 0;
    for (int i = 0; i < kIntervals; ++i) {
      auto draws = uniform_draws(200, static_cast<std::uint64_t>(i));
      std::sort(draws.begin(), draws.end());
      covered += covers(quantile_of(draws, p), p) ? 1 : 0;
    }
    // Ends of intervals have integer ranks, so the intervals cover the quantile a little too often.
    EXPECT_GE(covered, kExpected - kSlack) << p;
    EXPECT_LE(covered, kExpected + kSlack) << p;
  }
}

TEST(QuantileTest, AMillionValuesAreCountedExactly) {
  std::vector<double> rising;
  for (int i = 1; i <= 1'000'000; ++i) {
    rising.push_back(i);
  }
  const auto median = quantile_of(rising, 0.5);
  EXPECT_NEAR(median.from, 500'000.0 - 980.0, 1.0);  // 1.96 sqrt(n)/2
  EXPECT_NEAR(median.to, 500'000.0 + 981.0, 1.0);
}

// The example of R. G. Newcombe, Two-sided confidence intervals for the single proportion, Stat.
// Med. 17 (1998), table I, method 3.
TEST(ProbabilityTest, WilsonsIntervalIsThePublishedOne) {
  const auto some = probability_of(81, 263);
  EXPECT_NEAR(some.from, 0.2553, 5e-5);
  EXPECT_NEAR(some.to, 0.3662, 5e-5);
  const auto few = probability_of(15, 148);
  EXPECT_NEAR(few.from, 0.0624, 5e-5);
  EXPECT_NEAR(few.to, 0.1605, 5e-5);
  const auto none = probability_of(0, 20);
  EXPECT_EQ(none.from, 0.0);
  EXPECT_NEAR(none.to, 0.1611, 5e-5);
  const auto one = probability_of(1, 29);
  EXPECT_NEAR(one.from, 0.0061, 5e-5);
  EXPECT_NEAR(one.to, 0.1718, 5e-5);
  EXPECT_EQ(probability_of(20, 20).to, 1.0);
  EXPECT_TRUE(std::isnan(probability_of(0, 0).value));
}

TEST(CorrelationTest, ItIsOneOnALineAndUndefinedForConstantValues) {
  const std::vector<double> x{1.0, 2.0, 3.0, 4.0, 5.0};
  EXPECT_DOUBLE_EQ(correlation_of(x, std::vector<double>{-2.0, -4.0, -6.0, -8.0, -10.0}).value,
                   -1.0);
  EXPECT_LT(correlation_of(x, std::vector<double>{1.0, 16.0, 81.0, 256.0, 625.0}).value, 0.95);
  EXPECT_TRUE(std::isnan(correlation_of(x, std::vector<double>(5, 3.0)).value));
  const std::vector<double> rising{1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  EXPECT_TRUE(std::isnan(correlation_of(rising, std::vector<double>(6, 0.1)).value))
      << "the sum of six times 0.1 is rounded";
  EXPECT_TRUE(std::isnan(correlation_of({}, {}).value));
}

TEST(CorrelationTest, IntervalsCoverTheCorrelationOfNormalPairs) {
  constexpr double rho = 0.6;
  int covered = 0;
  for (int i = 0; i < kIntervals; ++i) {
    const auto x = normal_draws(100, 2 * static_cast<std::uint64_t>(i), 0.0, 1.0);
    auto y = normal_draws(100, 2 * static_cast<std::uint64_t>(i) + 1, 0.0, 1.0);
    for (std::size_t k = 0; k < y.size(); ++k) {
      y[k] = rho * x[k] + std::sqrt(1.0 - rho * rho) * y[k];
    }
    covered += covers(correlation_of(x, y), rho) ? 1 : 0;
  }
  EXPECT_NEAR(covered, kExpected, kSlack);
}

}  // namespace
}  // namespace oblique::client
