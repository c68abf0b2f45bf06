#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace oblique::client {

// Numbers as people read them. Output for programs has all digits and SI units.

/// A length of time: "0.4 s", "12 s", "3 min 05 s", "2 h 10 min", "3 d 04 h".
std::string format_duration(double seconds);

/// A number of things: "950", "14,300".
std::string format_count(std::uint64_t count);
/// With its noun: "1 point", "14,300 points".
std::string counted(std::uint64_t count, std::string_view one, std::string_view many);

/// A rate to three digits, whole from a hundred on: "0.31", "84.4", "14,300".
std::string format_rate(double per_s);

/// A size: "120 bytes", "1.3 MB", "24 GB"; a kB has 1000 bytes.
std::string format_bytes(std::uint64_t bytes);

}  // namespace oblique::client
