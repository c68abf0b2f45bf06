#pragma once

#include <chrono>

namespace oblique::test {

/// Longest time that a test waits for an event. It only ends tests that hang.
inline constexpr std::chrono::minutes kHangLimit{10};

}  // namespace oblique::test
