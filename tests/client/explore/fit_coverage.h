#pragma once

#include <cstdint>

namespace oblique::test {

/// Number of fits, and how many of their 95 % intervals of k and eta2 contain the true value.
struct Coverage {
  int fits = 0;
  int k = 0;
  int eta2 = 0;
};

/// Fits k and eta2 of the preset `paper` repeatedly to synthetic measurements: peak forces of five
/// impacts with the true values, plus normal noise of 1 %. With `is_scaled` the fits take the noise
/// for 3 %, and scale it. Solves all points in this process.
Coverage fit_coverage(int fits, std::uint64_t seed, bool is_scaled = false);

}  // namespace oblique::test
