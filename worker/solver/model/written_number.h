#pragma once

#include <cstddef>

namespace oblique::solver {

/// Longest text of `exact_number` [bytes].
inline constexpr std::size_t kLongestExactNumber = 32;

/// Writes what `exact_number` (number.h) gives to `at`, where there is room for the longest such
/// text, without a zero byte behind it, and gives its end. For many numbers into one text.
char* write_exact_number(double value, char* at);

}  // namespace oblique::solver
