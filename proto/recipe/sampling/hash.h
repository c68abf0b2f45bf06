#pragma once

#include <cstdint>

// Hashed numbers by SplitMix64 (Steele, Lea and Flood, Fast splittable pseudorandom number
// generators, 2014): number `index` of the sequence of `key`, without the ones before it.
namespace oblique::sampling {

/// A bijection of 64 bits of which every bit of the result depends on every bit of `z`.
constexpr std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

constexpr std::uint64_t hashed(std::uint64_t key, std::uint64_t index) {
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15;  // 2^64 over the golden ratio, odd
  return mixed(key + (index + 1) * kGolden);
}

}  // namespace oblique::sampling
