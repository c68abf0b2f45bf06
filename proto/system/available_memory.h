#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace oblique::protocol {

/// Memory that this process can still allocate: what the machine has free, or the limit of the
/// container or service if that is less [bytes].
std::uint64_t available_memory_bytes();

/// The tightest memory limit of the control groups (version 2) from this process's group upwards
/// [bytes]; none if there is no limit. `root` is where groups are mounted, `own` the text of
/// /proc/self/cgroup.
std::optional<std::uint64_t> memory_limit_bytes(const std::string& root, const std::string& own);

}  // namespace oblique::protocol
