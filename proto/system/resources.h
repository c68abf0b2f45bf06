#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace oblique::protocol {

/// Returns the memory that this process can still allocate [bytes]: the free memory of the machine,
/// or the limit of the container or service if that is less.
std::uint64_t available_memory_bytes();

/// Returns the smallest memory limit [bytes] of the control groups (version 2) from this process's
/// group up to the root; nothing if no group has a limit. `root` is the mount point, and `own` the
/// text of /proc/self/cgroup.
std::optional<std::uint64_t> memory_limit_bytes(const std::string& root, const std::string& own);

}  // namespace oblique::protocol
