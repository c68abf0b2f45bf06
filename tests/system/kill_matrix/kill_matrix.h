#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/system/kill_matrix/kill_cycle.h"

namespace oblique::test {

struct MatrixReport {
  std::uint64_t cycles = 0;
  std::uint64_t not_struck = 0;       ///< the study ended before the point was reached
  std::map<std::string, int> blows;   ///< by program and signal
  std::vector<std::string> failures;  ///< the case and what was wrong
};

/// Runs the cases of `count` seeds from `first_seed`, several at once: most of their time they wait
/// for somebody to be given up.
MatrixReport run_matrix(std::uint64_t first_seed, std::uint64_t count);

}  // namespace oblique::test
