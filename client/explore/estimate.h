#pragma once

#include <limits>

namespace oblique::client {

/// An estimate with its 95 % interval; NaN: undefined.
struct Estimate {
  double value = std::numeric_limits<double>::quiet_NaN();
  double from = std::numeric_limits<double>::quiet_NaN();
  double to = std::numeric_limits<double>::quiet_NaN();

  double half_width() const { return (to - from) / 2.0; }
};

}  // namespace oblique::client
