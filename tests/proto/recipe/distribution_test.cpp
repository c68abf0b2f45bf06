#include "proto/recipe/distribution.h"

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/recipes.h"

namespace oblique::sampling {
namespace {

Quantiles uniform(double from, double to) {
  return Quantiles(protocol::uniform("k", from, to));
}

Quantiles log_uniform(double from, double to) {
  protocol::Axis axis = protocol::uniform("k", from, to);
  axis.mutable_distribution()->set_kind(protocol::DISTRIBUTION_LOG_UNIFORM);
  return Quantiles(axis);
}

Quantiles normal(double mean, double sd, double from, double to) {
  protocol::Axis axis = protocol::uniform("k", from, to);
  axis.mutable_distribution()->set_kind(protocol::DISTRIBUTION_NORMAL);
  axis.mutable_distribution()->set_mean(mean);
  axis.mutable_distribution()->set_sd(sd);
  return Quantiles(axis);
}

/// Mean of `of` over the values in the middles of `n` equal parts: the integral over the
/// distribution, nearly.
double mean_of(const Quantiles& distribution, const std::function<double(double)>& of) {
  constexpr int kParts = 100'000;
  double sum = 0.0;
  for (int i = 0; i < kParts; ++i) {
    sum += of(distribution.value_at((i + 0.5) / kParts));
  }
  return sum / kParts;
}

double mean(const Quantiles& distribution) {
  return mean_of(distribution, [](double x) { return x; });
}

double variance(const Quantiles& distribution) {
  const double center = mean(distribution);
  return mean_of(distribution, [&](double x) { return (x - center) * (x - center); });
}

// Digits of tables: M. Abramowitz and I. A. Stegun, Handbook of Mathematical Functions, table 26.5,
// and, from 1e-10 on, those that AS 241 gives as its checks.
TEST(NormalTest, QuantilesAreThoseOfTheTables) {
  EXPECT_NEAR(normal_quantile(0.5), 0.0, 1e-17);
  EXPECT_NEAR(normal_quantile(0.25), -0.6744897501960817, 1e-15);
  EXPECT_NEAR(normal_quantile(0.001), -3.090232306167814, 4e-15);
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 2e-15);
  EXPECT_NEAR(normal_quantile(1e-20), -9.262340089798408, 1e-14);
}

// An error of one part in 1e16 in z is one of z^2 such parts in p.
TEST(NormalTest, QuantileAndPartBelowUndoEachOther) {
  for (double p = 1e-300; p < 0.5; p *= 1.7) {
    const double z = normal_quantile(p);
    EXPECT_NEAR(normal_part_below(z) / p, 1.0, 1e-15 * (2.0 + z * z)) << p;
  }
}

TEST(NormalTest, QuantilesOnBothSidesOfTheMeanMirrorEachOther) {
  for (double p = 0x1p-50; p < 0.5; p *= 2.0) {
    EXPECT_EQ(normal_quantile(1.0 - p), -normal_quantile(p)) << p;
  }
}

TEST(NormalTest, NothingAndAllAreBelowTheInfinities) {
  EXPECT_EQ(normal_part_below(-std::numeric_limits<double>::infinity()), 0.0);
  EXPECT_EQ(normal_part_below(std::numeric_limits<double>::infinity()), 1.0);
}

TEST(DistributionTest, UniformValuesHaveTheirMomentsAndTheirEndsAsLimits) {
  const auto quantiles = uniform(0.3, 1.1);
  EXPECT_NEAR(mean(quantiles), 0.7, 1e-12);
  EXPECT_NEAR(variance(quantiles), 0.8 * 0.8 / 12.0, 1e-9);
  EXPECT_NEAR(quantiles.value_at(0x1p-53), 0.3, 1e-15);
  EXPECT_NEAR(quantiles.value_at(1.0 - 0x1p-53), 1.1, 1e-15);
}

TEST(DistributionTest, LogUniformValuesHaveAUniformLogarithm) {
  const auto distribution = log_uniform(1e4, 1e8);
  EXPECT_NEAR(distribution.value_at(0.5), 1e6, 1e-9);
  EXPECT_NEAR(distribution.value_at(0.25), 1e5, 1e-10);
  EXPECT_NEAR(mean_of(distribution, [](double x) { return std::log10(x); }), 6.0, 1e-9);
  EXPECT_NEAR(mean(distribution), (1e8 - 1e4) / std::log(1e4), 1e2);
}

TEST(DistributionTest, NormalValuesHaveTheirMomentsAndQuantiles) {
  const auto quantiles = normal(0.4, 0.05, -std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::infinity());
  EXPECT_NEAR(mean(quantiles), 0.4, 1e-12);
  EXPECT_NEAR(variance(quantiles), 0.05 * 0.05, 1e-6);
  EXPECT_EQ(quantiles.value_at(0.5), 0.4);
  EXPECT_NEAR(quantiles.value_at(0.975), 0.4 + 0.05 * 1.959963984540054, 1e-15);
  EXPECT_EQ(quantiles.part_left(), 1.0);
}

// Mean and variance of a normal distribution that is cut off at a and b, in units of sd from the
// mean: with Z = Phi(b) - Phi(a), (phi(a) - phi(b))/Z and 1 + (a phi(a) - b phi(b))/Z - mean^2.
TEST(DistributionTest, ATruncatedNormalHasTheMomentsOfTheory) {
  const auto phi = [](double z) {
    return std::isinf(z) ? 0.0 : std::exp(-z * z / 2.0) / std::sqrt(2.0 * std::acos(-1.0));
  };
  const auto edge = [&](double z) { return std::isinf(z) ? 0.0 : z * phi(z); };
  for (const auto& [a, b] :
       std::vector<std::pair<double, double>>{{-1.0, 1.0},
                                              {-0.5, std::numeric_limits<double>::infinity()},
                                              {-std::numeric_limits<double>::infinity(), -2.0},
                                              {3.0, std::numeric_limits<double>::infinity()},
                                              {5.0, 6.0}}) {
    const auto cut = normal(10.0, 2.0, 10.0 + 2.0 * a, 10.0 + 2.0 * b);
    const double part = a > 0.0 ? normal_part_below(-a) - normal_part_below(-b)
                                : normal_part_below(b) - normal_part_below(a);
    const double mean_z = (phi(a) - phi(b)) / part;
    EXPECT_NEAR(cut.part_left() / part, 1.0, 1e-13);
    EXPECT_NEAR(mean(cut), 10.0 + 2.0 * mean_z, 1e-4) << a << " to " << b;
    EXPECT_NEAR(variance(cut), 4.0 * (1.0 + (edge(a) - edge(b)) / part - mean_z * mean_z), 1e-3)
        << a << " to " << b;
  }
}

TEST(DistributionTest, ValuesRiseWithTheFractionAndStayBetweenTheEnds) {
  for (const auto& distribution : {uniform(-1.0, 2.0), log_uniform(1e-3, 1e3),
                                   normal(0.0, 1.0, -0.1, 8.0), normal(0.0, 1.0, 30.0, 31.0)}) {
    double before = distribution.value_at(0x1p-53);
    for (double fraction = 1e-4; fraction < 1.0; fraction += 1e-4) {
      const double value = distribution.value_at(fraction);
      EXPECT_GT(value, before);
      before = value;
    }
    EXPECT_GE(distribution.value_at(1.0 - 0x1p-53), before);
  }
  const auto tail = normal(0.0, 1.0, 30.0, 31.0);
  EXPECT_GE(tail.value_at(0x1p-53), 30.0);
  EXPECT_LE(tail.value_at(1.0 - 0x1p-53), 31.0);
}

TEST(DistributionTest, WhatIsLeftTooFarFromTheMeanIsSaid) {
  EXPECT_GT(normal(0.0, 1.0, 36.0, 37.0).part_left(), Quantiles::kLeastPart);
  EXPECT_LT(normal(0.0, 1.0, 38.0, 39.0).part_left(), Quantiles::kLeastPart);
  EXPECT_EQ(normal(0.0, 1.0, 1e10, std::numeric_limits<double>::infinity()).part_left(), 0.0);
}

// A study's points are these for ever, but for the last bits of <cmath>.
TEST(DistributionTest, ValuesAreThoseOfTheFirstVersion) {
  EXPECT_DOUBLE_EQ(uniform(0.3, 1.1).value_at(0.123), 0.39839999999999998);
  EXPECT_DOUBLE_EQ(log_uniform(0.01, 2.0).value_at(0.123), 0.019187866556359772);
  EXPECT_DOUBLE_EQ(normal(0.4, 0.05, 0.0, std::numeric_limits<double>::infinity()).value_at(0.123),
                   0.34199400585012418);
  EXPECT_DOUBLE_EQ(normal(0.4, 0.05, 0.5, 0.6).value_at(0.987), 0.57040805991834731);
}

}  // namespace
}  // namespace oblique::sampling
