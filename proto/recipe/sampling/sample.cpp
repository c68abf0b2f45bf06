#include "proto/recipe/sampling/sample.h"

#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>

#include "proto/recipe/sampling/hash.h"
#include "proto/recipe/sampling/permutation.h"

namespace oblique::sampling {
namespace {

/// What one dimension of a sample is hashed with.
std::uint64_t key_of(const Sample& sample, std::uint32_t dimension) {
  return hashed(mixed(hashed(static_cast<std::uint64_t>(sample.kind), sample.seed)), dimension);
}

/// The middle of interval `bits` of 2^`digits` equal ones. Exact for up to 52 digits, so neither 0
/// nor 1.
double middle(std::uint64_t bits, int digits) {
  return std::ldexp(static_cast<double>(bits) + 0.5, -digits);
}

double random_fraction(std::uint64_t key, std::uint64_t index) {
  constexpr int kDigits = 52;
  return middle(hashed(key, index) >> (64 - kDigits), kDigits);
}

/// (stratum + u) / count with u in (0, 1). u has as many digits as leave the sum exact: the
/// quotient then stays within the stratum and below 1.
double stratified_fraction(std::uint64_t count, std::uint64_t key, std::uint64_t index) {
  const std::uint64_t stratum = permuted(index, count, key);
  const int digits = 52 - static_cast<int>(std::bit_width(count));
  const double within = middle(hashed(mixed(key), index) >> (64 - digits), digits);
  return (static_cast<double>(stratum) + within) / static_cast<double>(count);
}

}  // namespace

bool can_grow(Kind kind) {
  return kind != Kind::kLatinHypercube;
}

double fraction(const Sample& sample, std::uint32_t dimension, std::uint64_t index) {
  if (index >= sample.count || sample.count > kMostPoints || dimension >= kMostDimensions) {
    throw std::out_of_range("a sample of " + std::to_string(sample.count) +
                            " points has no coordinate " + std::to_string(dimension) +
                            " of a point " + std::to_string(index));
  }
  const std::uint64_t key = key_of(sample, dimension);
  switch (sample.kind) {
    case Kind::kRandom:
      break;
    case Kind::kLatinHypercube:
      return stratified_fraction(sample.count, key, index);
    case Kind::kSobol:
      return middle(owen_scrambled(sobol_bits(index, dimension), key), kSobolBits);
  }
  return random_fraction(key, index);
}

}  // namespace oblique::sampling
