#pragma once

#include <optional>
#include <span>

namespace oblique::client {

/// How values behave whose mesh or step is halved from one to the next.
enum class Trend {
  kTooFew,       ///< fewer than three values: nothing can be said
  kRounding,     ///< the last two values are the same but for rounding
  kMonotone,     ///< the last two differences have one sign, and the last is smaller
  kOscillating,  ///< the last difference is smaller and of the other sign
  kUnsettled,    ///< the last difference is not or hardly smaller: no limit to be seen
};

/// What a sequence v_1, v_2, ..., v_m says of its limit by Richardson's extrapolation. With
/// d_1 = v_{m-1} - v_{m-2} and d_2 = v_m - v_{m-1}:
///
///   order p = log2 |d_1 / d_2|,   limit = v_m + d_2 / (2^p - 1),   error = |limit - v_m|
///
/// for monotone values. Where p exceeds the order P that theory promises, the last difference is
/// small by luck: then d_2 is not believed to be smaller than d_1 2^-P, and p = P is used for the
/// error. Oscillating values are not extrapolated: limit = v_m, error = max(|d_2|, |d_1| 2^-P).
/// For unsettled values, those of an order below kLeastOrder among them, the error is the larger
/// difference, which bounds nothing.
inline constexpr double kLeastOrder = 0.4;
struct Extrapolation {
  Trend trend = Trend::kTooFew;
  double limit = 0.0;
  std::optional<double>
      order;  ///< observed, as it is; where the differences have one sign and fall
  std::optional<double>
      error;  ///< estimated, of the last value; nothing with fewer than two values
};

/// Extrapolates `values`, coarsest first; not empty. `highest_order` is P. Differences below
/// `resolution` (in the values' unit) are rounding.
Extrapolation extrapolate(std::span<const double> values, double highest_order, double resolution);

}  // namespace oblique::client
