#pragma once

#include <cstdint>
#include <string>

// Memory and processors that this process may use. `root` is the root folder; tests have their own.
namespace oblique::protocol {

/// Returns the memory that this process can still allocate [bytes]: the free memory of the machine,
/// or the smallest limit of its control groups (version 2) if that is less.
std::uint64_t available_memory_bytes(const std::string& root = "");

struct Processors {
  unsigned count = 1;
  std::string reason{};  ///< why other processors of the machine are not used; empty if all are
};

/// Returns the processors that the affinity mask and the quotas of control groups (versions 1 and
/// 2) allow. A quota of 1.5 processors counts as 2.
Processors usable_processors(const std::string& root = "");

}  // namespace oblique::protocol
