#pragma once

#include <cstdint>
#include <string>

// How studies may share the workers.
namespace oblique::protocol {

inline constexpr std::int64_t kHighestPriority = 1000;  ///< the lowest is its negative
inline constexpr double kLeastWeight = 0.001;
inline constexpr double kLargestWeight = 1000.0;

/// Why no study can have that priority or weight, or an empty text.
std::string objection_to_priority(std::int64_t priority);
std::string objection_to_weight(double weight);

/// What is allowed, for help texts: "-1000 to 1000" and "0.001 to 1000".
std::string allowed_priorities();
std::string allowed_weights();

}  // namespace oblique::protocol
