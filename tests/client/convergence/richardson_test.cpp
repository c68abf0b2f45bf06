#include "client/convergence/richardson.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

constexpr double kNoRounding = 0.0;

// limit + c h^p for h = 1, 1/2, 1/4, ...
std::vector<double> sequence(double limit, double c, double p, int values) {
  std::vector<double> all;
  for (int i = 0; i < values; ++i) {
    all.push_back(limit + c * std::exp2(-p * i));
  }
  return all;
}

TEST(Richardson, FindsOrderLimitAndErrorOfAPureErrorTermExactly) {
  for (const double order : {0.5, 1.0, 2.0, 3.7}) {
    const auto values = sequence(7.0, -3.0, order, 4);
    const auto found = extrapolate(values, 4.0, kNoRounding);
    EXPECT_EQ(found.trend, Trend::kMonotone);
    EXPECT_NEAR(found.order.value(), order, 1e-12);
    EXPECT_NEAR(found.limit, 7.0, 1e-12);
    EXPECT_NEAR(found.error.value(), 7.0 - values.back(), 1e-12);
  }
}

TEST(Richardson, UsesTheFinestThreeValuesOnly) {
  auto values = sequence(1.0, 1.0, 2.0, 3);
  values.insert(values.begin(), 1000.0);
  EXPECT_NEAR(extrapolate(values, 4.0, kNoRounding).limit, 1.0, 1e-12);
}

TEST(Richardson, ErrorEstimateIsRightToLeadingOrderWhenAHigherTermIsPresent) {
  // v(h) = 2 + h^2 + h^3: on h = 1/16, 1/32, 1/64 the next term is h = 1/64 of the first.
  std::vector<double> values;
  for (const double h : {1.0 / 16, 1.0 / 32, 1.0 / 64}) {
    values.push_back(2.0 + h * h + h * h * h);
  }
  const auto found = extrapolate(values, 4.0, kNoRounding);
  const double error = values.back() - 2.0;
  EXPECT_NEAR(found.error.value(), error, 0.1 * error);
  EXPECT_NEAR(found.order.value(), 2.0, 0.1);
}

TEST(Richardson, DoesNotBelieveALastDifferenceThatIsSmallByLuck) {
  // Differences 16 and 1e-6: an order of 24, which no method of order 2 has.
  const std::vector<double> values{0.0, 16.0, 16.000001};
  const auto found = extrapolate(values, 2.0, kNoRounding);
  EXPECT_GT(found.order.value(), 20.0);
  EXPECT_DOUBLE_EQ(found.error.value(), 16.0 / 4.0 / 3.0);
}

TEST(Richardson, DoesNotExtrapolateValuesThatOscillate) {
  const std::vector<double> values{0.0, 8.0, 6.0};
  const auto found = extrapolate(values, 4.0, kNoRounding);
  EXPECT_EQ(found.trend, Trend::kOscillating);
  EXPECT_FALSE(found.order);
  EXPECT_EQ(found.limit, 6.0);
  EXPECT_EQ(found.error, 2.0);
}

TEST(Richardson, SaysSoWhenDifferencesDoNotFall) {
  const std::vector<double> values{0.0, 1.0, 2.0};
  const auto found = extrapolate(values, 4.0, kNoRounding);
  EXPECT_EQ(found.trend, Trend::kUnsettled);
  EXPECT_EQ(found.error, 1.0);
  EXPECT_FALSE(found.order);
}

TEST(Richardson, TakesDifferencesBelowTheResolutionForRounding) {
  const std::vector<double> values{1.0, 1.0 + 1e-12, 1.0 - 1e-12};
  const auto found = extrapolate(values, 4.0, 1e-11);
  EXPECT_EQ(found.trend, Trend::kRounding);
  EXPECT_EQ(found.error, 1e-11);
  const std::vector<double> zeros{0.0, 0.0, 0.0};
  EXPECT_EQ(extrapolate(zeros, 4.0, kNoRounding).trend, Trend::kRounding);
}

TEST(Richardson, SaysNothingOfALimitFromFewerThanThreeValues) {
  const std::vector<double> two{1.0, 3.0};
  EXPECT_EQ(extrapolate(two, 4.0, kNoRounding).trend, Trend::kTooFew);
  EXPECT_EQ(extrapolate(two, 4.0, kNoRounding).error, 2.0);
  const std::vector<double> one{1.0};
  EXPECT_FALSE(extrapolate(one, 4.0, kNoRounding).error);
}

}  // namespace
}  // namespace oblique::client
