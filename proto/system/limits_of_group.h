#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace oblique::protocol {

/// What a container or a service may take of its machine, by its control group (cgroup version 2).
struct LimitsOfGroup {
  std::optional<double> cores = {};
  std::optional<std::uint64_t> memory_bytes = {};
};

/// The tightest limits from this process's group upwards. `root` and `own` are for tests: where
/// groups are mounted, and the text of /proc/self/cgroup.
LimitsOfGroup limits_of_group(const std::string& root, const std::string& own);
LimitsOfGroup limits_of_group();

/// Memory that this process can still take: what the machine has free, or its group's limit if
/// that is less [bytes].
std::uint64_t available_memory_bytes();

}  // namespace oblique::protocol
