#include "proto/recipe/written/study_priority.h"

#include <spdlog/fmt/fmt.h>

namespace oblique::protocol {

std::string allowed_priorities() {
  return fmt::format("{} to {}", -kHighestPriority, kHighestPriority);
}

std::string objection_to_priority(std::int64_t priority) {
  const bool is_allowed = priority >= -kHighestPriority && priority <= kHighestPriority;
  return is_allowed
             ? ""
             : fmt::format("priority = {} is not allowed: {} is", priority, allowed_priorities());
}

}  // namespace oblique::protocol
