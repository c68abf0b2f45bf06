#include "proto/recipe/sampling.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>
#include <string>

#include "proto/recipe/blocks.h"
#include "proto/recipe/vendor/joe_kuo.h"

namespace oblique::sampling {
namespace {

/// Maps 64-bit numbers one to one. Every bit of the result depends on every bit of `z`.
std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

/// Permutes the numbers of `bits` bits by a Feistel network. The halves of a number may differ in
/// length. Each round changes one half by a hash of the other, so the round is invertible.
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

/// Returns the image of `i` < `n` under the permutation of 0 ... n-1 that `key` selects.
std::uint64_t permuted(std::uint64_t i, std::uint64_t n, std::uint64_t key) {
  if (n < 2) {
    return 0;
  }
  // Permutes all numbers that have as many bits as n - 1, and repeats this until the result is
  // below n.
  const auto bits = static_cast<int>(std::bit_width(n - 1));
  do {
    i = shuffled_bits(i, bits, key);
  } while (i >= n);
  return i;
}

/// The direction numbers of one dimension, times 2^52.
using Directions = std::array<std::uint64_t, kSobolBits>;

/// Computes v_k = a_1 v_(k-1) + ... + a_(s-1) v_(k-s+1) + v_(k-s) + v_(k-s) / 2^s, without carry,
/// from the first s numbers.
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

constexpr auto kDirections = [] {
  std::array<Directions, kSobolDimensions> all{};
  for (std::size_t k = 0; k < kSobolBits; ++k) {
    all[0][k] = std::uint64_t{1} << (kSobolBits - 1 - k);
  }
  for (std::size_t i = 0; i < kJoeKuo.size(); ++i) {
    all[i + 1] = directions_of(kJoeKuo[i]);
  }
  return all;
}();

/// Returns the middle of interval number `bits` of 2^`digits` equal intervals of (0, 1). The result
/// is exact up to 52 digits, so it is never 0 or 1.
double middle(std::uint64_t bits, int digits) {
  return std::ldexp(static_cast<double>(bits) + 0.5, -digits);
}

/// Returns (stratum + u) / count with u in (0, 1). u has so few digits that the sum is exact, so
/// the quotient is within the stratum and below 1.
double stratified_fraction(std::uint64_t count, std::uint64_t key, std::uint64_t index) {
  const int digits = kSobolBits - static_cast<int>(std::bit_width(count));
  const double within = middle(hashed(mixed(key), index) >> (64 - digits), digits);
  return (static_cast<double>(permuted(index, count, key)) + within) / static_cast<double>(count);
}

}  // namespace

std::uint64_t hashed(std::uint64_t key, std::uint64_t index) {
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15;  // 2^64 / golden ratio, an odd number
  return mixed(key + (index + 1) * kGolden);
}

std::uint64_t sobol_bits(std::uint64_t index, std::uint32_t dimension) {
  const Directions& v = kDirections.at(dimension);
  std::uint64_t bits = 0;
  for (std::uint64_t rest = index ^ (index >> 1); rest != 0; rest &= rest - 1) {
    bits ^= v[static_cast<std::size_t>(std::countr_zero(rest))];
  }
  return bits;
}

std::uint64_t owen_scrambled(std::uint64_t bits, std::uint64_t key) {
  // One hash provides the random bits for a tree with six levels, which has 63 nodes.
  constexpr int kLevels = 6;
  std::uint64_t scrambled = 0;
  for (int depth = 0; depth < kSobolBits; depth += kLevels) {
    const std::uint64_t root = (std::uint64_t{1} << depth) | (bits >> (kSobolBits - depth));
    const std::uint64_t flips = hashed(key, root);
    std::uint64_t node = 1;  // 1 is the root of the tree, with the children 2 and 3
    const int levels = std::min(kLevels, kSobolBits - depth);
    for (int level = 0; level < levels; ++level) {
      const std::uint64_t digit = (bits >> (kSobolBits - 1 - depth - level)) & 1;
      scrambled = (scrambled << 1) | (digit ^ ((flips >> node) & 1));
      node = (node << 1) | digit;
    }
  }
  return scrambled;
}

double fraction(const protocol::Sample& sample, std::uint32_t dimension, std::uint64_t index) {
  if (index >= sample.count() || sample.count() > kMaxSamples) {
    throw std::out_of_range("a sample of " + std::to_string(sample.count()) +
                            " points has no point " + std::to_string(index));
  }
  const std::uint64_t key =
      hashed(mixed(hashed(static_cast<std::uint64_t>(sample.kind()), sample.seed())), dimension);
  switch (sample.kind()) {
    case protocol::SAMPLE_LATIN_HYPERCUBE:
      return stratified_fraction(sample.count(), key, index);
    case protocol::SAMPLE_SOBOL:
      return middle(owen_scrambled(sobol_bits(index, dimension), key), kSobolBits);
    default:
      return middle(hashed(key, index) >> (64 - kSobolBits), kSobolBits);
  }
}

double normal_part_below(double z) {
  return 0.5 * std::erfc(-z / std::numbers::sqrt2);
}

double normal_quantile(double p) {
  if (p > 0.5) {
    return -normal_quantile(1.0 - p);
  }
  // Start value, within 4.5e-4: M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions,
  // 26.2.23.
  const double t = std::sqrt(-2.0 * std::log(p));
  double z = (2.515517 + t * (0.802853 + t * 0.010328)) /
                 (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308))) -
             t;
  // Halley's method for Phi(z) = p, where Phi'' = -z Phi'. Each step cubes the error.
  constexpr int kSteps = 3;
  for (int i = 0; i < kSteps; ++i) {
    const double density = std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
    const double step = (normal_part_below(z) - p) / density;
    z -= step / (1.0 + 0.5 * z * step);
  }
  return z;
}

Quantiles::Quantiles(const protocol::Axis& axis)
    : kind_(axis.distribution().kind()),
      mean_(axis.distribution().mean()),
      sd_(axis.distribution().sd()),
      from_(protocol::smallest_value(axis)),
      to_(protocol::largest_value(axis)) {
  if (kind_ == protocol::DISTRIBUTION_NORMAL) {
    const double from_z = (from_ - mean_) / sd_;
    const double to_z = (to_ - mean_) / sd_;
    is_mirrored_ = from_z + to_z > 0.0;
    below_from_ = normal_part_below(is_mirrored_ ? -to_z : from_z);
    below_to_ = normal_part_below(is_mirrored_ ? -from_z : to_z);
  }
}

double Quantiles::value_at(double fraction) const {
  double value = 0.0;
  if (kind_ == protocol::DISTRIBUTION_NORMAL) {
    const double part = is_mirrored_ ? 1.0 - fraction : fraction;
    const double z = normal_quantile(below_from_ * (1.0 - part) + below_to_ * part);
    value = mean_ + sd_ * (is_mirrored_ ? -z : z);
  } else if (kind_ == protocol::DISTRIBUTION_LOG_UNIFORM) {
    const auto from = static_cast<long double>(from_);
    value = static_cast<double>(
        from * std::pow(static_cast<long double>(to_) / from, static_cast<long double>(fraction)));
  } else {
    value = from_ * (1.0 - fraction) + to_ * fraction;
  }
  return std::clamp(value, from_, to_);
}

}  // namespace oblique::sampling
