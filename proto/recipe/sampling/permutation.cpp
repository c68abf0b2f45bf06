#include "proto/recipe/sampling/permutation.h"

#include <bit>

#include "proto/recipe/sampling/hash.h"

namespace oblique::sampling {
namespace {

/// A permutation of the numbers of `bits` bits: a Feistel network of two halves, which may differ
/// in length. Each round changes one half by a hash of the other, so it can be undone, whatever the
/// hash.
std::uint64_t shuffled_bits(std::uint64_t value, int bits, std::uint64_t key) {
  constexpr std::uint64_t kRounds = 8;
  const int low_bits = (bits + 1) / 2;
  const std::uint64_t low_mask = (std::uint64_t{1} << low_bits) - 1;
  const std::uint64_t high_mask = (std::uint64_t{1} << (bits - low_bits)) - 1;
  std::uint64_t low = value & low_mask;
  std::uint64_t high = value >> low_bits;
  for (std::uint64_t round = 0; round < kRounds; round += 2) {
    low ^= (hashed(key + round, high) >> 32) & low_mask;
    high ^= (hashed(key + round + 1, low) >> 32) & high_mask;
  }
  return (high << low_bits) | low;
}

}  // namespace

std::uint64_t permuted(std::uint64_t i, std::uint64_t n, std::uint64_t key) {
  if (n < 2) {
    return 0;
  }
  // Walks along the cycle of `i` among all numbers of as many bits until it is back below n.
  const auto bits = static_cast<int>(std::bit_width(n - 1));
  do {
    i = shuffled_bits(i, bits, key);
  } while (i >= n);
  return i;
}

}  // namespace oblique::sampling
