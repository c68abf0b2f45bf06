#pragma once

#include <cstdint>
#include <functional>

namespace oblique::test {

/// How often 95 % intervals of fits to synthetic measurements cover the truth.
struct Coverage {
  int fits = 0;
  int k = 0;
  int eta2 = 0;
};

/// Fits k and eta2 of the preset paper to peak forces and contact times of five impacts, computed
/// with the true values and disturbed by normal noise of 1 %, in this process. `after_each` is
/// called with the counts after each fit.
Coverage fit_coverage(int fits, std::uint64_t seed,
                      const std::function<void(const Coverage&)>& after_each = {});

}  // namespace oblique::test
