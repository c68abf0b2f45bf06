#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace oblique::solver {

/// The shortest text that reads back as the same bits: 0.1, 1e-06, -0, nan. Without an exponent
/// from 0.0001 up to a million, and elsewhere where that is as short. For input and files; the
/// other functions are for people.
std::string exact_number(double value);

/// Longest text of `exact_number` [bytes].
inline constexpr std::size_t kLongestExactNumber = 32;
/// Writes that text to `at`, without a terminating zero, and returns its end.
char* write_exact_number(double value, char* at);

/// `value` rounded to `significant` digits (1 to 17), without trailing zeros and never -0; digits
/// before the point are all kept. With an exponent only below 0.0001, and from a million or from
/// 10^`significant` on, whichever is larger.
std::string readable_number(double value, int significant = 6);

/// `value` with `decimals` (0 to 17) digits after the point, never -0.00.
std::string fixed_number(double value, int decimals);

/// `fixed_number` with a sign, unless it rounds to zero: +0.05, -1.10, 0.00.
std::string signed_number(double value, int decimals);

/// The number that is the whole of `text`, without spaces or a plus. Reads what `exact_number`
/// writes, infinities and NaN too.
std::optional<double> number_of(std::string_view text);

}  // namespace oblique::solver
