#include "proto/recipe/sample.h"

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/recipes.h"

namespace oblique::sampling {
namespace {

std::vector<protocol::SampleKind> all_kinds() {
  return {protocol::SAMPLE_RANDOM, protocol::SAMPLE_LATIN_HYPERCUBE, protocol::SAMPLE_SOBOL};
}

TEST(SampleTest, ALatinHypercubeHasOnePointInEachStratumOfEachDimension) {
  for (const std::uint64_t count : std::vector<std::uint64_t>{1, 2, 3, 10, 1000, 4097}) {
    const auto sample = protocol::sample_of(protocol::SAMPLE_LATIN_HYPERCUBE, count, 42);
    for (const std::uint32_t d : {0U, 1U, kSobolDimensions - 1}) {
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
  for (const auto kind : all_kinds()) {
    for (const std::uint64_t count : {std::uint64_t{1'000'000'000}, kMostPoints}) {
      for (const std::uint64_t index : {std::uint64_t{0}, count / 3, count - 1}) {
        for (std::uint32_t d = 0; d < kSobolDimensions; ++d) {
          const double x = fraction(protocol::sample_of(kind, count, 1), d, index);
          EXPECT_GT(x, 0.0);
          EXPECT_LT(x, 1.0);
        }
      }
    }
  }
}

TEST(SampleTest, RandomAndSobolPointsStayWhenTheCountGrowsAndThoseOfALatinHypercubeDoNot) {
  for (const auto kind : all_kinds()) {
    int same = 0;
    for (std::uint64_t i = 0; i < 100; ++i) {
      same += fraction(protocol::sample_of(kind, 100, 1), 2, i) ==
                      fraction(protocol::sample_of(kind, 1000, 1), 2, i)
                  ? 1
                  : 0;
    }
    EXPECT_EQ(same == 100, kind != protocol::SAMPLE_LATIN_HYPERCUBE);
  }
}

TEST(SampleTest, AnotherSeedGivesOtherPointsInEveryDimension) {
  for (const auto kind : all_kinds()) {
    for (std::uint32_t d = 0; d < kSobolDimensions; ++d) {
      EXPECT_NE(fraction(protocol::sample_of(kind, 50, 1), d, 7),
                fraction(protocol::sample_of(kind, 50, 2), d, 7));
    }
  }
}

// The mean of n independent uniform numbers is 1/2 within 5 sqrt(1/12/n), the correlation of two
// rows of them 0 within 5/sqrt(n).
TEST(SampleTest, RandomDimensionsAreUniformAndUnrelated) {
  constexpr std::uint64_t kCount = 10'000;
  const auto sample = protocol::sample_of(protocol::SAMPLE_RANDOM, kCount, 3);
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
  EXPECT_EQ(fraction(protocol::sample_of(protocol::SAMPLE_RANDOM, 1000, 1), 0, 0),
            0.73936814972315379);
  EXPECT_EQ(fraction(protocol::sample_of(protocol::SAMPLE_RANDOM, 1000, 1), 2, 999),
            0.22969086515040626);
  EXPECT_EQ(fraction(protocol::sample_of(protocol::SAMPLE_LATIN_HYPERCUBE, 1000, 1), 0, 0),
            0.38446179410117737);
  EXPECT_EQ(fraction(protocol::sample_of(protocol::SAMPLE_LATIN_HYPERCUBE, 1000, 1), 2, 999),
            0.64296594597464052);
  EXPECT_EQ(fraction(protocol::sample_of(protocol::SAMPLE_SOBOL, 1000, 1), 0, 0),
            0.87448832597572423);
  EXPECT_EQ(fraction(protocol::sample_of(protocol::SAMPLE_SOBOL, 1000, 1), 2, 999),
            0.33081070278466262);
}

TEST(SampleTest, APointOrDimensionThatThereIsNotIsRefused) {
  for (const auto kind : all_kinds()) {
    EXPECT_THROW(fraction(protocol::sample_of(kind, 10, 1), 0, 10), std::out_of_range);
    EXPECT_THROW(fraction(protocol::sample_of(kind, 0, 1), 0, 0), std::out_of_range);
    EXPECT_THROW(fraction(protocol::sample_of(kind, kMostPoints + 1, 1), 0, 0), std::out_of_range);
  }
  EXPECT_THROW(fraction(protocol::sample_of(protocol::SAMPLE_SOBOL, 10, 1), kSobolDimensions, 0),
               std::out_of_range);
  EXPECT_NO_THROW(
      fraction(protocol::sample_of(protocol::SAMPLE_RANDOM, 10, 1), kSobolDimensions, 0));
}

}  // namespace
}  // namespace oblique::sampling
