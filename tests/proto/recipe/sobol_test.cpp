#include "proto/recipe/sample.h"

#include <cstdint>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proto/recipe/sha256.h"

namespace oblique::sampling {
namespace {

/// Digest of points in all dimensions, each coordinate times 2^64 in eight bytes, the least first.
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

// The first ten points in three dimensions as Joe and Kuo print them.
TEST(SobolTest, TheFirstPointsAreThosePublished) {
  const std::vector<std::vector<double>> published{{0, 0, 0},
                                                   {0.5, 0.5, 0.5},
                                                   {0.75, 0.25, 0.25},
                                                   {0.25, 0.75, 0.75},
                                                   {0.375, 0.375, 0.625},
                                                   {0.875, 0.875, 0.125},
                                                   {0.625, 0.125, 0.875},
                                                   {0.125, 0.625, 0.375},
                                                   {0.1875, 0.3125, 0.9375},
                                                   {0.6875, 0.8125, 0.4375}};
  for (std::uint64_t i = 0; i < published.size(); ++i) {
    for (std::uint32_t d = 0; d < 3; ++d) {
      EXPECT_EQ(static_cast<double>(sobol_bits(i, d)) * 0x1p-52, published[i][d])
          << "point " << i << ", dimension " << d;
    }
  }
}

// Digests of what boost::random::sobol(32) of Boost 1.74 gives: it leaves out the origin, so its
// point i is ours i + 1. The far ones are behind `seed(2^40 - 17)`.
TEST(SobolTest, AllDimensionsAreThoseOfBoost) {
  EXPECT_EQ(digest_of_points(1, 4096),
            "9ec19155dfd8ef8b7ce1b7bd2e7c349bf4734b172ed36d96519d9b3f7f30f0dc");
  EXPECT_EQ(digest_of_points((std::uint64_t{1} << 40) - 16, 64),
            "2e0a943ce4abbb8cde32391d7c06b0c91af8387eabb7ebe44375ae30c1f5111a");
}

TEST(SobolTest, ADimensionThatThereIsNotIsRefused) {
  EXPECT_NO_THROW(sobol_bits(3, kSobolDimensions - 1));
  EXPECT_THROW(sobol_bits(3, kSobolDimensions), std::out_of_range);
}

// Nested: digit k of the result is digit k of the value, changed or not by what the digits before
// it say alone. So two values agree in as many first digits after as before, and in no more.
TEST(OwenScramblingTest, ValuesShareAsManyFirstDigitsAfterAsBefore) {
  for (int shared = 0; shared < kSobolBits; ++shared) {
    const std::uint64_t value = 0x9e3779b97f4a7 ^ (std::uint64_t{1} << shared);
    const std::uint64_t other = value ^ (std::uint64_t{1} << (kSobolBits - 1 - shared));
    const std::uint64_t changed = owen_scrambled(value, 5) ^ owen_scrambled(other, 5);
    EXPECT_EQ(changed >> (kSobolBits - 1 - shared), 1U) << shared << " digits";
  }
}

// Of 4096 keys a digit is changed in half, with a standard deviation of 32; and of 2^12 values with
// different first twelve digits, the thirteenth too: it is drawn for each anew.
TEST(OwenScramblingTest, ADigitIsChangedForHalfOfTheKeysAndForHalfOfTheDigitsBeforeIt) {
  for (int digit = 0; digit < kSobolBits; ++digit) {
    int changed = 0;
    for (std::uint64_t key = 0; key < 4096; ++key) {
      changed += static_cast<int>((owen_scrambled(0, key) >> digit) & 1);
    }
    EXPECT_NEAR(changed, 2048, 5 * 32) << "digit " << digit;
  }
  int changed = 0;
  for (std::uint64_t prefix = 0; prefix < 4096; ++prefix) {
    changed += static_cast<int>((owen_scrambled(prefix << 40, 1) >> 39) & 1);
  }
  EXPECT_NEAR(changed, 2048, 5 * 32);
}

TEST(OwenScramblingTest, NoTwoValuesBecomeOne) {
  std::set<std::uint64_t> seen;
  for (std::uint64_t value = 0; value < 4096; ++value) {
    seen.insert(owen_scrambled(value, 99));
  }
  EXPECT_EQ(seen.size(), 4096U);
}

}  // namespace
}  // namespace oblique::sampling
