#pragma once

namespace oblique::protocol {

// Exit codes of our programs.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongUsage = 2;

}  // namespace oblique::protocol
