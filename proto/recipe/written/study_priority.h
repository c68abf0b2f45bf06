#pragma once

#include <cstdint>
#include <string>

namespace oblique::protocol {

inline constexpr std::int64_t kHighestPriority = 1000;  ///< the lowest is its negative

/// Why a study cannot have that priority, or an empty text.
std::string objection_to_priority(std::int64_t priority);

/// The allowed range for help texts: "-1000 to 1000".
std::string allowed_priorities();

}  // namespace oblique::protocol
