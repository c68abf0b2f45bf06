#include "proto/recipe/sample.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::sampling {
namespace {

std::vector<std::uint64_t> all_permuted(std::uint64_t n, std::uint64_t key) {
  std::vector<std::uint64_t> images(n);
  std::iota(images.begin(), images.end(), 0);
  for (auto& i : images) {
    i = permuted(i, n, key);
  }
  return images;
}

TEST(PermutationTest, EveryNumberBelowNIsTheImageOfOne) {
  for (const std::uint64_t n :
       std::vector<std::uint64_t>{1, 2, 3, 4, 5, 7, 8, 9, 100, 1023, 1024, 1025, 100'000}) {
    auto images = all_permuted(n, 12345);
    std::sort(images.begin(), images.end());
    for (std::uint64_t i = 0; i < n; ++i) {
      ASSERT_EQ(images[i], i) << "of " << n;
    }
  }
}

TEST(PermutationTest, NumbersOfATrillionStayBelowItAndDiffer) {
  constexpr std::uint64_t kTrillion = 1'000'000'000'000;
  std::vector<std::uint64_t> images;
  for (std::uint64_t i = kTrillion - 1000; i < kTrillion; ++i) {
    images.push_back(permuted(i, kTrillion, 7));
    EXPECT_LT(images.back(), kTrillion);
  }
  std::sort(images.begin(), images.end());
  EXPECT_EQ(std::adjacent_find(images.begin(), images.end()), images.end());
}

// Each of the 24 orders of four numbers comes 1000 times in 24000 on average, with a standard
// deviation of 31.
TEST(PermutationTest, EveryOrderOfFourIsAsLikelyAsAnyOther) {
  std::map<std::vector<std::uint64_t>, int> seen;
  for (std::uint64_t key = 0; key < 24'000; ++key) {
    ++seen[all_permuted(4, key * 1000)];
  }
  ASSERT_EQ(seen.size(), 24U);
  for (const auto& [order, times] : seen) {
    EXPECT_NEAR(times, 1000, 5 * 31);
  }
}

// Ranks of 1000 numbers in two permutations: their correlation is 0 within 5/sqrt(1000).
TEST(PermutationTest, TwoKeysGiveUnrelatedOrders) {
  constexpr double kMean = 499.5;
  constexpr double kVariance = 1000.0 * 1000.0 / 12.0;
  for (std::uint64_t key = 0; key < 20; ++key) {
    double covariance = 0.0;
    for (std::uint64_t i = 0; i < 1000; ++i) {
      covariance += (static_cast<double>(permuted(i, 1000, key)) - kMean) *
                    (static_cast<double>(permuted(i, 1000, key + 1)) - kMean) / 1000.0;
    }
    EXPECT_LT(std::abs(covariance / kVariance), 5.0 / std::sqrt(1000.0)) << "key " << key;
  }
}

}  // namespace
}  // namespace oblique::sampling
