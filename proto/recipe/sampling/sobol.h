#pragma once

#include <cstdint>

namespace oblique::sampling {

/// Dimensions that Sobol's sequence has here, and binary digits of its values.
inline constexpr std::uint32_t kSobolDimensions = 128;
inline constexpr int kSobolBits = 52;

/// Value `index` of the sequence in one dimension, counted from 0, times 2^52. Points follow each
/// other in the order of the Gray code, as in other programs. `index` must be below 2^52. Throws
/// std::out_of_range for a dimension that there is not.
std::uint64_t sobol_bits(std::uint64_t index, std::uint32_t dimension);

/// `bits` after nested uniform scrambling (A. B. Owen, Randomly permuted (t,m,s)-nets and
/// (t,s)-sequences, 1995): whether a digit is changed is drawn anew for each value of all digits
/// before it. Every elementary interval of base 2 keeps its number of points.
std::uint64_t owen_scrambled(std::uint64_t bits, std::uint64_t key);

}  // namespace oblique::sampling
