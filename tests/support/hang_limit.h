#pragma once

#include <chrono>

namespace oblique::test {

/// How long a test waits for an event. It only ends a hang: no sound run comes near it.
inline constexpr std::chrono::minutes kHangLimit{10};

}  // namespace oblique::test
