#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace oblique::server {

/// What a child process may take.
struct ChildLimits {
  std::size_t output_bytes = std::size_t{32} << 20U;
  std::uint64_t memory_bytes = std::uint64_t{2} << 30U;  ///< of address space; 0: no limit
  std::chrono::seconds processor{20};                    ///< of processor time
};

/// What became of it.
struct ChildEnd {
  enum class Kind {
    kEnded,    ///< with `code`
    kKilled,   ///< by somebody else: the system, for want of memory
    kStopped,  ///< here, because `is_over`
    kTooLong,  ///< here, because its output is
  };
  Kind kind = Kind::kEnded;
  int code = 0;
  std::string output;  ///< on standard output
  std::string said;    ///< the beginning of what it said on standard error
};

/// Runs `program` with these arguments, the first being its name, without a shell: behind others
/// (nice), with no input, none of our descriptors, and no variable of the environment that is
/// called OBLIQUE_. It and what it started are killed when `is_over`, which is asked some times a
/// second. Throws std::system_error when it cannot be started.
ChildEnd run_child(const std::string& program, std::vector<std::string> arguments,
                   const ChildLimits& limits, const std::function<bool()>& is_over);

}  // namespace oblique::server
