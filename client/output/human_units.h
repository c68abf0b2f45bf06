#pragma once

#include <cstdint>
#include <string>

namespace oblique::client {

// Numbers as people read them. What programs read is printed with all digits and in SI units.

/// A length of time: "0.4 s", "12 s", "3 min 05 s", "2 h 10 min", "3 d 04 h".
std::string shown_duration(double seconds);

/// How many: "950", "14,300".
std::string shown_count(std::uint64_t count);

/// To three digits, whole from a hundred on: "0.31", "84.4", "14,300".
std::string shown_rate(double per_s);

/// A size: "120 bytes", "1.3 MB", "24 GB"; a kB has 1000 bytes.
std::string shown_bytes(std::uint64_t bytes);

}  // namespace oblique::client
