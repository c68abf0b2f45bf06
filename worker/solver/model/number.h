#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace oblique::solver {

/// Returns the shortest text that reads back as the same bits, for files: 0.1, 1e-06, -0, nan.
/// Numbers from 0.0001 up to a million have no exponent, others only if it shortens the text.
std::string exact_number(double value);

/// Longest text of `exact_number` [bytes].
inline constexpr std::size_t kLongestExactNumber = 32;
/// Writes the text of `exact_number` to `at`, without a terminating zero, and returns its end.
char* write_exact_number(double value, char* at);

/// Returns `value` rounded to `significant` digits (1 to 17), without trailing zeros and never -0.
/// Digits before the point are never rounded. The text has an exponent only below 0.0001 and from
/// max(10^6, 10^`significant`) on.
std::string readable_number(double value, int significant = 6);

/// `value` with `decimals` (0 to 17) digits after the point, never -0.00.
std::string fixed_number(double value, int decimals);

/// `fixed_number` with a sign, unless it rounds to zero: +0.05, -1.10, 0.00.
std::string signed_number(double value, int decimals);

/// Parses a text written by `exact_number`, infinities and NaN included. Returns nothing for other
/// text, such as one with spaces or a plus.
std::optional<double> number_of(std::string_view text);

/// Returns why a text such as 1e-400 is no number, to follow "is not a number"; or an empty text.
std::string_view why_no_number(std::string_view text);

}  // namespace oblique::solver
