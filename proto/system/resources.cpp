#include "proto/system/available_memory.h"

#include <algorithm>
#include <fstream>
#include <iterator>

namespace oblique::protocol {

std::optional<std::uint64_t> memory_limit_bytes(const std::string& root, const std::string& own) {
  std::optional<std::uint64_t> limit;
  const auto at = own.find("0::/");
  if (at == std::string::npos) {
    return limit;
  }
  std::string path = own.substr(at + 3, own.find('\n', at) - at - 3);
  // In a container the path may be valid only on the host. Missing files are skipped.
  for (bool is_top = false; !is_top; path.resize(is_top ? 0 : path.rfind('/'))) {
    is_top = path.size() <= 1;
    std::uint64_t bytes = 0;
    if (std::ifstream((is_top ? root : root + path) + "/memory.max") >> bytes) {
      limit = std::min(limit.value_or(bytes), bytes);
    }
  }
  return limit;
}

std::uint64_t available_memory_bytes() {
  constexpr std::uint64_t kKibibyte = 1024;
  std::uint64_t bytes = std::uint64_t{2} << 30U;  // used if the free memory is unknown
  std::ifstream words("/proc/meminfo");
  for (std::string word; words >> word;) {
    if (std::uint64_t kibibytes = 0; word == "MemAvailable:" && words >> kibibytes) {
      bytes = kKibibyte * kibibytes;
    }
  }
  std::ifstream own("/proc/self/cgroup");
  const auto limit =
      memory_limit_bytes("/sys/fs/cgroup", {std::istreambuf_iterator<char>(own), {}});
  return std::min(bytes, limit.value_or(bytes));
}

}  // namespace oblique::protocol
