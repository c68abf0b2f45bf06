#include "proto/recipe/sampling/sobol.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <stdexcept>

#include "proto/recipe/sampling/hash.h"
#include "proto/recipe/sampling/joe_kuo.h"

namespace oblique::sampling {
namespace {

/// Direction numbers of one dimension, times 2^52.
using Directions = std::array<std::uint64_t, kSobolBits>;

/// m_k of a direction, from the first s of them:
/// v_k = a_1 v_(k-1) + ... + a_(s-1) v_(k-s+1) + v_(k-s) + v_(k-s) / 2^s, all without carry.
constexpr Directions directions_of(const Direction& first) {
  Directions v{};
  const std::size_t s = first.s;
  for (std::size_t k = 0; k < v.size(); ++k) {
    if (k < s) {
      v[k] = std::uint64_t{first.m[k]} << (v.size() - 1 - k);
      continue;
    }
    v[k] = v[k - s] ^ (v[k - s] >> s);
    for (std::size_t back = 1; back < s; ++back) {
      v[k] ^= ((first.a >> (s - 1 - back)) & 1U) != 0 ? v[k - back] : 0;
    }
  }
  return v;
}

constexpr std::array<Directions, kSobolDimensions> all_directions() {
  std::array<Directions, kSobolDimensions> all{};
  for (std::size_t k = 0; k < kSobolBits; ++k) {
    all[0][k] = std::uint64_t{1} << (kSobolBits - 1 - k);
  }
  for (std::size_t i = 0; i < kJoeKuo.size(); ++i) {
    all[i + 1] = directions_of(kJoeKuo[i]);
  }
  return all;
}

constexpr auto kDirections = all_directions();

}  // namespace

std::uint64_t sobol_bits(std::uint64_t index, std::uint32_t dimension) {
  const Directions& v = kDirections.at(dimension);
  std::uint64_t bits = 0;
  for (std::uint64_t rest = index ^ (index >> 1); rest != 0; rest &= rest - 1) {
    bits ^= v[static_cast<std::size_t>(std::countr_zero(rest))];
  }
  return bits;
}

std::uint64_t owen_scrambled(std::uint64_t bits, std::uint64_t key) {
  // One hash has the flips of all digits of a tree of six levels, which has 63 nodes.
  constexpr int kLevels = 6;
  std::uint64_t scrambled = 0;
  for (int depth = 0; depth < kSobolBits; depth += kLevels) {
    const std::uint64_t root = (std::uint64_t{1} << depth) | (bits >> (kSobolBits - depth));
    const std::uint64_t flips = hashed(key, root);
    std::uint64_t node = 1;  // in the tree: 1 at its root, then 2 and 3, 4 to 7, ...
    const int levels = std::min(kLevels, kSobolBits - depth);
    for (int level = 0; level < levels; ++level) {
      const std::uint64_t digit = (bits >> (kSobolBits - 1 - depth - level)) & 1;
      scrambled = (scrambled << 1) | (digit ^ ((flips >> node) & 1));
      node = (node << 1) | digit;
    }
  }
  return scrambled;
}

}  // namespace oblique::sampling
