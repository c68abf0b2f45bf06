#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace oblique::solver {

// Numbers as text and back, the same everywhere: `exact_number` where the text is read back or
// repeats what somebody wrote, the others where people read it.

/// The shortest text that reads back as the same bits: 0.1, 1e-06, -0, nan. Without an exponent
/// from 0.0001 up to a million, and elsewhere where that is as short.
std::string exact_number(double value);

/// Longest text of `exact_number` [bytes].
inline constexpr std::size_t kLongestExactNumber = 32;
/// Writes that text to `at`, where there is room for the longest, without a zero byte behind it,
/// and returns its end. For many numbers into one text.
char* write_exact_number(double value, char* at);

/// `value` rounded to so many significant digits (1 to 17), without zeros at its end and never -0;
/// digits before the point are all kept. With an exponent only below 0.0001, and from a million or
/// from 10^`significant` on, whichever is larger.
std::string readable_number(double value, int significant = 6);

/// `value` with so many decimals (0 to 17), never -0.00. For columns of aligned numbers.
std::string fixed_number(double value, int decimals);

/// `fixed_number` with a sign always, but for what rounds to nothing: +0.05, -1.10, 0.00.
std::string signed_number(double value, int decimals);

/// The number that `text` is from end to end, without spaces or a plus; nothing for any other text.
/// Reads back what `exact_number` wrote, infinities and NaN too.
std::optional<double> number_of(std::string_view text);

}  // namespace oblique::solver
