#include "proto/recipe/written/study_terms.h"

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/number.h"

namespace oblique::protocol {

using solver::exact_number;

std::string allowed_priorities() {
  return fmt::format("{} to {}", -kHighestPriority, kHighestPriority);
}

std::string allowed_weights() {
  return fmt::format("{} to {}", exact_number(kLeastWeight), exact_number(kLargestWeight));
}

std::string objection_to_priority(std::int64_t priority) {
  const bool is_allowed = priority >= -kHighestPriority && priority <= kHighestPriority;
  return is_allowed
             ? ""
             : fmt::format("priority = {} is not allowed: {} is", priority, allowed_priorities());
}

std::string objection_to_weight(double weight) {
  const bool is_allowed = weight >= kLeastWeight && weight <= kLargestWeight;
  return is_allowed ? ""
                    : fmt::format("weight = {} is not allowed: {} is", exact_number(weight),
                                  allowed_weights());
}

}  // namespace oblique::protocol
