#pragma once

#include <cstdlib>

namespace oblique::test {

/// Returns a number of repetitions: `all` if the environment variable OBLIQUE_TEST_ALL is set,
/// which `deploy/test --all` does, else `quick`.
inline int amount(int quick, int all) {
  return std::getenv("OBLIQUE_TEST_ALL") != nullptr ? all : quick;
}

}  // namespace oblique::test
