#pragma once

#include <cstdint>

#include "proto/recipe/sampling/sobol.h"

namespace oblique::sampling {

enum class Kind {
  kRandom,          ///< independent points
  kLatinHypercube,  ///< one point in each of `count` equal strata of every dimension
  kSobol,           ///< Sobol's sequence, scrambled as by Owen
};

/// Points in the unit cube, each a pure function of its index.
struct Sample {
  Kind kind = Kind::kRandom;
  std::uint64_t count = 0;
  std::uint64_t seed = 0;
};

/// Most dimensions of a sample, and most points.
inline constexpr std::uint32_t kMostDimensions = kSobolDimensions;
inline constexpr std::uint64_t kMostPoints = std::uint64_t{1} << 44;

/// Whether the points stay the same when `count` grows.
bool can_grow(Kind kind);

/// Coordinate `dimension` of point `index` < `count`: above 0 and below 1, the same bits on every
/// machine, in time that does not grow with `count`. Throws std::out_of_range for a dimension or
/// point that there is not.
double fraction(const Sample& sample, std::uint32_t dimension, std::uint64_t index);

}  // namespace oblique::sampling
