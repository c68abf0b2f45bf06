#pragma once

#include <cstdint>
#include <functional>

namespace oblique::test {

/// Number of fits, and how many of their 95 % intervals of k and eta2 contain the true value.
struct Coverage {
  int fits = 0;
  int k = 0;
  int eta2 = 0;
};

/// Fits k and eta2 of the preset `paper` repeatedly to synthetic measurements: peak forces of five
/// impacts with the true values, plus normal noise of 1 %. Solves all points in this process. Calls
/// `after_each` with the counts after each fit.
Coverage fit_coverage(int fits, std::uint64_t seed,
                      const std::function<void(const Coverage&)>& after_each = {});

}  // namespace oblique::test
