#pragma once

#include <limits>

namespace oblique::client {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Values that differ by at most this part of their size may differ by rounding errors alone.
inline constexpr double kRounding = 1e-12;

/// An estimate with its 95 % interval; NaN: undefined.
struct Estimate {
  double value = kNaN;
  double from = kNaN;
  double to = kNaN;

  double half_width() const { return (to - from) / 2.0; }
};

}  // namespace oblique::client
