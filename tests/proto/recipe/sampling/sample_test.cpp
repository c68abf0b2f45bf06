#include "proto/recipe/sampling/sample.h"

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::sampling {
namespace {

std::vector<Kind> all_kinds() {
  return {Kind::kRandom, Kind::kLatinHypercube, Kind::kSobol};
}

TEST(SampleTest, ALatinHypercubeHasOnePointInEachStratumOfEachDimension) {
  for (const std::uint64_t count : std::vector<std::uint64_t>{1, 2, 3, 10, 1000, 4097}) {
    const Sample sample{Kind::kLatinHypercube, count, 42};
    for (const std::uint32_t d : {0U, 1U, kMostDimensions - 1}) {
      std::vector<bool> hit(count, false);
      for (std::uint64_t i = 0; i < count; ++i) {
        const auto stratum =
            static_cast<std::size_t>(fraction(sample, d, i) * static_cast<double>(count));
        ASSERT_FALSE(hit.at(stratum)) << "stratum " << stratum << " of " << count;
        hit[stratum] = true;
      }
    }
  }
}

TEST(SampleTest, AnyPointOfAThousandMillionAndOfTheMostIsFoundAtOnceWithinTheOpenCube) {
  for (const Kind kind : all_kinds()) {
    for (const std::uint64_t count : {std::uint64_t{1'000'000'000}, kMostPoints}) {
      for (const std::uint64_t index : {std::uint64_t{0}, count / 3, count - 1}) {
        for (std::uint32_t d = 0; d < kMostDimensions; ++d) {
          const double x = fraction({kind, count, 1}, d, index);
          EXPECT_GT(x, 0.0);
          EXPECT_LT(x, 1.0);
        }
      }
    }
  }
}

TEST(SampleTest, RandomAndSobolPointsStayWhenTheCountGrowsAndThoseOfALatinHypercubeDoNot) {
  for (const Kind kind : all_kinds()) {
    int same = 0;
    for (std::uint64_t i = 0; i < 100; ++i) {
      same += fraction({kind, 100, 1}, 2, i) == fraction({kind, 1000, 1}, 2, i) ? 1 : 0;
    }
    EXPECT_EQ(same == 100, can_grow(kind));
  }
}

TEST(SampleTest, AnotherSeedGivesOtherPointsInEveryDimension) {
  for (const Kind kind : all_kinds()) {
    for (std::uint32_t d = 0; d < kMostDimensions; ++d) {
      EXPECT_NE(fraction({kind, 50, 1}, d, 7), fraction({kind, 50, 2}, d, 7));
    }
  }
}

// The mean of n independent uniform numbers is 1/2 within 5 sqrt(1/12/n), the correlation of two
// rows of them 0 within 5/sqrt(n).
TEST(SampleTest, RandomDimensionsAreUniformAndUnrelated) {
  constexpr std::uint64_t kCount = 10'000;
  const Sample sample{Kind::kRandom, kCount, 3};
  for (std::uint32_t d = 0; d < 20; ++d) {
    double sum = 0.0;
    double covariance = 0.0;
    for (std::uint64_t i = 0; i < kCount; ++i) {
      const double x = fraction(sample, d, i) - 0.5;
      sum += x;
      covariance += x * (fraction(sample, d + 1, i) - 0.5);
    }
    EXPECT_LT(std::abs(sum / kCount), 5.0 * std::sqrt(1.0 / 12.0 / kCount));
    EXPECT_LT(std::abs(covariance / kCount) * 12.0, 5.0 / std::sqrt(kCount));
  }
}

// A study's points are these for ever: stored studies mean them.
TEST(SampleTest, ValuesAreThoseOfTheFirstVersion) {
  EXPECT_EQ(fraction({Kind::kRandom, 1000, 1}, 0, 0), 0.73936814972315379);
  EXPECT_EQ(fraction({Kind::kRandom, 1000, 1}, 2, 999), 0.22969086515040626);
  EXPECT_EQ(fraction({Kind::kLatinHypercube, 1000, 1}, 0, 0), 0.38446179410117737);
  EXPECT_EQ(fraction({Kind::kLatinHypercube, 1000, 1}, 2, 999), 0.64296594597464052);
  EXPECT_EQ(fraction({Kind::kSobol, 1000, 1}, 0, 0), 0.87448832597572423);
  EXPECT_EQ(fraction({Kind::kSobol, 1000, 1}, 2, 999), 0.33081070278466262);
}

TEST(SampleTest, APointOrDimensionThatThereIsNotIsRefused) {
  for (const Kind kind : all_kinds()) {
    EXPECT_THROW(fraction({kind, 10, 1}, 0, 10), std::out_of_range);
    EXPECT_THROW(fraction({kind, 0, 1}, 0, 0), std::out_of_range);
    EXPECT_THROW(fraction({kind, 10, 1}, kMostDimensions, 0), std::out_of_range);
    EXPECT_THROW(fraction({kind, kMostPoints + 1, 1}, 0, 0), std::out_of_range);
  }
}

}  // namespace
}  // namespace oblique::sampling
