// How evenly samples fill the unit cube.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "proto/recipe/sample.h"
#include "tests/support/recipes.h"

namespace oblique::sampling {
namespace {

/// Coordinates of the points of a sample, point after point.
std::vector<double> points(const protocol::Sample& sample, std::uint32_t dimensions) {
  std::vector<double> all;
  for (std::uint64_t index = 0; index < sample.count(); ++index) {
    for (std::uint32_t d = 0; d < dimensions; ++d) {
      all.push_back(fraction(sample, d, index));
    }
  }
  return all;
}

/// Square of the L2 star discrepancy (T. T. Warnock 1972): the mean over all boxes with a corner at
/// the origin of (part of the points in it - its volume)^2.
double discrepancy_squared(const std::vector<double>& x, std::size_t dimensions) {
  const std::size_t n = x.size() / dimensions;
  double single = 0.0;
  double pairs = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    double product = 1.0;
    for (std::size_t d = 0; d < dimensions; ++d) {
      product *= (1.0 - x[i * dimensions + d] * x[i * dimensions + d]) / 2.0;
    }
    single += product;
    for (std::size_t j = 0; j < n; ++j) {
      product = 1.0;
      for (std::size_t d = 0; d < dimensions; ++d) {
        product *= 1.0 - std::max(x[i * dimensions + d], x[j * dimensions + d]);
      }
      pairs += product;
    }
  }
  const auto count = static_cast<double>(n);
  return std::pow(3.0, -static_cast<double>(dimensions)) - 2.0 / count * single +
         pairs / (count * count);
}

/// Mean of it over some seeds, relative to what independent points have on average:
/// (2^-d - 3^-d) / n.
double relative_discrepancy_squared(protocol::SampleKind kind, std::uint64_t count,
                                    std::uint32_t dimensions) {
  constexpr std::uint64_t kSeeds = 8;
  double sum = 0.0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    sum +=
        discrepancy_squared(points(protocol::sample_of(kind, count, seed), dimensions), dimensions);
  }
  const double d = dimensions;
  const double random = (std::pow(2.0, -d) - std::pow(3.0, -d)) / static_cast<double>(count);
  return sum / static_cast<double>(kSeeds) / random;
}

TEST(DiscrepancyTest, RandomPointsAreAsUnevenAsChanceHasIt) {
  EXPECT_NEAR(relative_discrepancy_squared(protocol::SAMPLE_RANDOM, 256, 3), 1.0, 0.4);
}

// In one dimension strata leave 1/n of the square; in three they take away what each axis adds
// alone.
TEST(DiscrepancyTest, ALatinHypercubeIsMoreEven) {
  EXPECT_LT(relative_discrepancy_squared(protocol::SAMPLE_LATIN_HYPERCUBE, 256, 1), 0.02);
  EXPECT_LT(relative_discrepancy_squared(protocol::SAMPLE_LATIN_HYPERCUBE, 256, 3), 0.5);
}

TEST(DiscrepancyTest, SobolPointsAreMoreEvenStillAndGainWithTheirNumber) {
  const double few = relative_discrepancy_squared(protocol::SAMPLE_SOBOL, 128, 3);
  const double many = relative_discrepancy_squared(protocol::SAMPLE_SOBOL, 1024, 3);
  EXPECT_LT(few, 0.1);
  EXPECT_LT(many, 0.02);
  EXPECT_LT(many, few / 3.0);
}

/// Whether 2^k points are one in each of the 2^k boxes that are 2^-a long in x and 2^(a-k) in y,
/// for every a. True of (0, 2)-sequences: dimensions 1 and 2 of Sobol's.
TEST(DiscrepancyTest, EveryElementaryIntervalOfTheFirstTwoDimensionsHasOnePoint) {
  for (const int k : {1, 4, 10}) {
    const auto sample = protocol::sample_of(protocol::SAMPLE_SOBOL, std::uint64_t{1} << k, 77);
    for (int a = 0; a <= k; ++a) {
      std::vector<int> hits(std::size_t{1} << k, 0);
      for (std::uint64_t i = 0; i < sample.count(); ++i) {
        const auto column = static_cast<std::size_t>(std::ldexp(fraction(sample, 0, i), a));
        const auto row = static_cast<std::size_t>(std::ldexp(fraction(sample, 1, i), k - a));
        ++hits[(column << (k - a)) + row];
      }
      EXPECT_EQ(std::count(hits.begin(), hits.end(), 1), 1 << k) << k << ", " << a;
    }
  }
}

/// Largest number of points of 2^k in a box of volume 2^(t-k) less the 2^t that belong there, over
/// all shapes of boxes.
int excess(const protocol::Sample& sample, int k, std::uint32_t x, std::uint32_t y, int t) {
  int worst = 0;
  const int digits = k - t;
  for (int a = 0; a <= digits; ++a) {
    std::vector<int> hits(std::size_t{1} << digits, 0);
    for (std::uint64_t i = 0; i < sample.count(); ++i) {
      const auto column = static_cast<std::size_t>(std::ldexp(fraction(sample, x, i), a));
      const auto row = static_cast<std::size_t>(std::ldexp(fraction(sample, y, i), digits - a));
      ++hits[(column << (digits - a)) + row];
    }
    worst = std::max(worst, *std::max_element(hits.begin(), hits.end()) - (1 << t));
  }
  return worst;
}

// Pairs of the first dimensions are (t, 2)-sequences with a t that Joe and Kuo's numbers keep
// small: of 1024 points every box of 1/1024 2^t has 2^t.
TEST(DiscrepancyTest, EveryPairOfTheFirstTenDimensionsHasItsNumberInEveryElementaryInterval) {
  constexpr int kDigits = 10;
  constexpr int kT = 5;
  const auto sample = protocol::sample_of(protocol::SAMPLE_SOBOL, std::uint64_t{1} << kDigits, 3);
  for (std::uint32_t x = 0; x < 10; ++x) {
    for (std::uint32_t y = x + 1; y < 10; ++y) {
      EXPECT_EQ(excess(sample, kDigits, x, y, kT), 0) << x << ", " << y;
    }
  }
}

// Any dimension alone is a (0, 1)-sequence, also from the middle of the sequence: each aligned run
// of 2^k points has one in each stratum.
TEST(DiscrepancyTest, EveryAlignedRunOfSobolPointsIsStratifiedInEachDimension) {
  const auto sample = protocol::sample_of(protocol::SAMPLE_SOBOL, 4096, 11);
  for (std::uint32_t d = 0; d < kSobolDimensions; ++d) {
    for (std::uint64_t first = 0; first < sample.count(); first += 256) {
      std::vector<bool> hit(256, false);
      for (std::uint64_t i = first; i < first + 256; ++i) {
        hit[static_cast<std::size_t>(fraction(sample, d, i) * 256.0)] = true;
      }
      ASSERT_EQ(std::count(hit.begin(), hit.end(), true), 256) << "dimension " << d;
    }
  }
}

}  // namespace
}  // namespace oblique::sampling
