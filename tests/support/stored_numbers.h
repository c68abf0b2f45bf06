#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include <gtest/gtest.h>

#include "server/store/rows/stored_units.h"

namespace oblique::server {

/// The unit in which rows have an output, a `..._s` or `..._N` in a list among them; nullptr: it is
/// kept as it is.
inline const StoredUnit* unit_of(std::string_view column) {
  const auto units = stored_units();
  const auto unit = std::find_if(units.begin(), units.end(),
                                 [&](const StoredUnit& one) { return one.column == column; });
  if (unit != units.end()) {
    return &*unit;
  }
  return column.ends_with("_s") ? &kListTime : column.ends_with("_N") ? &kListForce : nullptr;
}

/// By how much rounding may move a number of that result; 0: every bit is kept.
inline double half_unit_of(std::string_view column, const StoredDigits& digits) {
  const StoredUnit* unit = unit_of(column);
  const int decimals = unit == nullptr ? StoredDigits::kAllDigits : digits.decimals(*unit);
  return decimals == StoredDigits::kAllDigits ? 0.0
                                              : 0.5 * std::pow(10.0, -decimals) / unit->per_unit;
}

/// What is shown of an output is the number that its row keeps: rounded to its unit, and then as
/// far from it as a product and a quotient of doubles may be. Views write the numbers of lists with
/// 15 digits.
inline void expect_as_stored(double shown, double output, std::string_view column,
                             const StoredDigits& digits) {
  constexpr double kProductAndQuotient = 2.0 * std::numeric_limits<double>::epsilon();
  constexpr double kHalfOfTheLastOf15Digits = 0.5e-14;
  const StoredUnit* unit = unit_of(column);
  const bool is_in_list = unit == &kListTime || unit == &kListForce;
  const double relative = kProductAndQuotient + (is_in_list ? kHalfOfTheLastOf15Digits : 0.0);
  EXPECT_NEAR(shown, output, half_unit_of(column, digits) + relative * std::abs(output)) << column;
}

}  // namespace oblique::server
