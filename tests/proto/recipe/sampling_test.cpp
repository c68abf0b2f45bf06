// Tests of sample points in the unit cube, and of quantiles of distributions.
#include "proto/recipe/sampling.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "proto/recipe/model_message.h"
#include "tests/support/recipes.h"

namespace oblique::sampling {
namespace {

using protocol::SAMPLE_LATIN_HYPERCUBE;
using protocol::sample_of;
using protocol::SAMPLE_RANDOM;
using protocol::SAMPLE_SOBOL;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Returns a digest of the coordinates of points in all dimensions. Before hashing, each coordinate
/// is multiplied by 2^64 and written as eight bytes, least significant byte first.
std::string digest_of_points(std::uint64_t first, std::uint64_t count) {
  std::string bytes;
  for (std::uint64_t index = first; index < first + count; ++index) {
    for (std::uint32_t dimension = 0; dimension < kSobolDimensions; ++dimension) {
      const std::uint64_t bits = sobol_bits(index, dimension) << (64 - kSobolBits);
      for (int shift = 0; shift < 64; shift += 8) {
        bytes += static_cast<char>((bits >> shift) & 0xff);
      }
    }
  }
  return protocol::sha256_of(bytes);
}

// Digests of points of boost::random::sobol(32) in Boost 1.74. Boost leaves out the origin, so its
// point i is our point i + 1. The points of the second digest follow `seed(2^40 - 17)`.
TEST(SobolTest, AllDimensionsEqualThoseOfBoost) {
  EXPECT_EQ(digest_of_points(1, 4096),
            "9ec19155dfd8ef8b7ce1b7bd2e7c349bf4734b172ed36d96519d9b3f7f30f0dc");
  EXPECT_EQ(digest_of_points((std::uint64_t{1} << 40) - 16, 64),
            "2e0a943ce4abbb8cde32391d7c06b0c91af8387eabb7ebe44375ae30c1f5111a");
  EXPECT_THROW(sobol_bits(3, kSobolDimensions), std::out_of_range);
}

// Scrambling is nested: digit k of the result depends only on digits 1 to k of the value. So it
// does not change the number of leading digits that two values have in common.
TEST(OwenScramblingTest, ScramblingKeepsTheNumberOfCommonLeadingDigits) {
  for (int shared = 0; shared < kSobolBits; ++shared) {
    const std::uint64_t value = 0x9e3779b97f4a7 ^ (std::uint64_t{1} << shared);
    const std::uint64_t other = value ^ (std::uint64_t{1} << (kSobolBits - 1 - shared));
    const std::uint64_t changed = owen_scrambled(value, 5) ^ owen_scrambled(other, 5);
    EXPECT_EQ(changed >> (kSobolBits - 1 - shared), 1U) << shared << " digits";
  }
}

TEST(SampleTest, ALatinHypercubeHasOnePointInEachStratumOfEachDimension) {
  for (const std::uint64_t count : {1U, 2U, 3U, 10U, 1000U, 4097U}) {
    const auto sample = sample_of(SAMPLE_LATIN_HYPERCUBE, count, 42);
    for (const std::uint32_t d : {0U, 1U, kSobolDimensions - 1}) {
      std::set<std::uint64_t> strata;
      for (std::uint64_t i = 0; i < count; ++i) {
        strata.insert(
            static_cast<std::uint64_t>(fraction(sample, d, i) * static_cast<double>(count)));
      }
      EXPECT_EQ(strata.size(), count);
      EXPECT_LT(*strata.rbegin(), count);
    }
  }
}

TEST(SampleTest,
     EachPointOfTheLargestSampleIsComputedDirectlyLiesInTheOpenCubeAndDependsOnTheSeed) {
  for (const auto kind : {SAMPLE_RANDOM, SAMPLE_LATIN_HYPERCUBE, SAMPLE_SOBOL}) {
    for (const std::uint64_t index : {std::uint64_t{0}, kMaxSamples / 3, kMaxSamples - 1}) {
      for (std::uint32_t d = 0; d < kSobolDimensions; ++d) {
        const double x = fraction(sample_of(kind, kMaxSamples, 1), d, index);
        EXPECT_GT(x, 0.0);
        EXPECT_LT(x, 1.0);
        EXPECT_NE(x, fraction(sample_of(kind, kMaxSamples, 2), d, index));
      }
    }
    EXPECT_THROW(fraction(sample_of(kind, 10, 1), 0, 10), std::out_of_range);
    EXPECT_THROW(fraction(sample_of(kind, kMaxSamples + 1, 1), 0, 0), std::out_of_range);
  }
}

TEST(SampleTest, RandomAndSobolPointsKeepTheirValuesWhenTheCountGrowsUnlikeLatinHypercubes) {
  for (const auto kind : {SAMPLE_RANDOM, SAMPLE_LATIN_HYPERCUBE, SAMPLE_SOBOL}) {
    int same = 0;
    for (std::uint64_t i = 0; i < 100; ++i) {
      same += fraction(sample_of(kind, 100, 1), 2, i) == fraction(sample_of(kind, 1000, 1), 2, i);
    }
    EXPECT_EQ(same == 100, kind != SAMPLE_LATIN_HYPERCUBE);
  }
}

// Stored studies depend on these points, so the points must not change.
TEST(SampleTest, ValuesAreThoseOfTheFirstVersion) {
  for (const auto& [kind, of_first, of_last] :
       {std::tuple{SAMPLE_RANDOM, 0.73936814972315379, 0.22969086515040626},
        {SAMPLE_LATIN_HYPERCUBE, 0.38446179410117737, 0.64296594597464052},
        {SAMPLE_SOBOL, 0.87448832597572423, 0.33081070278466262}}) {
    EXPECT_EQ(fraction(sample_of(kind, 1000, 1), 0, 0), of_first);
    EXPECT_EQ(fraction(sample_of(kind, 1000, 1), 2, 999), of_last);
  }
}

Quantiles of_kind(protocol::DistributionKind kind, double from, double to, double mean = 0.0,
                  double sd = 0.0) {
  protocol::Axis axis = protocol::uniform("k", from, to);
  axis.mutable_distribution()->set_kind(kind);
  axis.mutable_distribution()->set_mean(mean);
  axis.mutable_distribution()->set_sd(sd);
  return Quantiles(axis);
}
Quantiles uniform(double from, double to) {
  return of_kind(protocol::DISTRIBUTION_UNIFORM, from, to);
}
Quantiles log_uniform(double from, double to) {
  return of_kind(protocol::DISTRIBUTION_LOG_UNIFORM, from, to);
}
Quantiles normal(double mean, double sd, double from, double to) {
  return of_kind(protocol::DISTRIBUTION_NORMAL, from, to, mean, sd);
}

/// Approximates the expected value of `of` by its mean over kParts quantiles with equally spaced
/// probabilities.
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

// The values are from M. Abramowitz and I. A. Stegun, Handbook of Mathematical Functions, table
// 26.5. The values from 1e-10 on are the check values of AS 241.
TEST(NormalTest, QuantilesAreThoseOfTheTables) {
  EXPECT_NEAR(normal_quantile(0.5), 0.0, 1e-17);
  EXPECT_NEAR(normal_quantile(0.25), -0.6744897501960817, 1e-15);
  EXPECT_NEAR(normal_quantile(0.001), -3.090232306167814, 4e-15);
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 2e-15);
  EXPECT_NEAR(normal_quantile(1e-20), -9.262340089798408, 1e-14);
}

// A relative error of 1e-16 in z causes a relative error of z^2 times 1e-16 in p.
TEST(NormalTest, QuantileAndProbabilityAreInverse) {
  for (double p = 1e-300; p < 0.5; p *= 1.7) {
    const double z = normal_quantile(p);
    EXPECT_NEAR(normal_part_below(z) / p, 1.0, 1e-15 * (2.0 + z * z)) << p;
  }
}

// A normal distribution truncated at a and b, in units of sd from the mean, has
//   mean = (phi(a) - phi(b))/Z and variance = 1 + (a phi(a) - b phi(b))/Z - mean^2
// with Z = Phi(b) - Phi(a).
TEST(DistributionTest, ATruncatedNormalHasTheTheoreticalMoments) {
  const auto phi = [](double z) {
    return std::isinf(z) ? 0.0 : std::exp(-z * z / 2.0) / std::sqrt(2.0 * std::acos(-1.0));
  };
  const auto edge = [&](double z) { return std::isinf(z) ? 0.0 : z * phi(z); };
  for (const auto& [a, b] : std::vector<std::pair<double, double>>{
           {-1.0, 1.0}, {-0.5, kInfinity}, {-kInfinity, -2.0}, {3.0, kInfinity}, {5.0, 6.0}}) {
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
  EXPECT_FALSE(std::isnormal(normal(0.0, 1.0, 38.0, 39.0).part_left()));
}

// Stored studies depend on these values. Only the last bits may differ between versions of <cmath>.
TEST(DistributionTest, ValuesAreThoseOfTheFirstVersion) {
  EXPECT_DOUBLE_EQ(uniform(0.3, 1.1).value_at(0.123), 0.39839999999999998);
  EXPECT_DOUBLE_EQ(log_uniform(0.01, 2.0).value_at(0.123), 0.019187866556359772);
  EXPECT_DOUBLE_EQ(normal(0.4, 0.05, 0.0, kInfinity).value_at(0.123), 0.34199400585012418);
  EXPECT_DOUBLE_EQ(normal(0.4, 0.05, 0.5, 0.6).value_at(0.987), 0.57040805991834731);
}

}  // namespace
}  // namespace oblique::sampling
