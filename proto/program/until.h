#pragma once

#include <chrono>
#include <optional>
#include <string_view>

namespace oblique::protocol {

/// How long it is from `now` to what `text` names; below 0 for a time that has passed. `text` is a
/// time in ISO 8601, as 2026-11-22T05:00:00Z, 2026-11-22T05:00+01:00 or, in local time,
/// 2026-11-22T05:00:00; or a duration from `now`: 5400, 5400s, 90m, 1h30m, 2d. Nothing for any
/// other text, and for what is more than a hundred years away.
std::optional<std::chrono::milliseconds> time_until(std::string_view text,
                                                    std::chrono::system_clock::time_point now);

}  // namespace oblique::protocol
