#include "proto/system/limits_of_group.h"

#include <algorithm>
#include <fstream>
#include <iterator>

namespace oblique::protocol {
namespace {

template <class Number>
void tighten(std::optional<Number>& limit, Number other) {
  limit = std::min(limit.value_or(other), other);
}

}  // namespace

LimitsOfGroup limits_of_group(const std::string& root, const std::string& own) {
  LimitsOfGroup limits;
  const auto at = own.find("0::/");
  if (at == std::string::npos) {
    return limits;
  }
  std::string path = own.substr(at + 3, own.find('\n', at) - at - 3);
  // In a container the path may be that of the machine, which does not exist there; the top does.
  for (bool is_top = false; !is_top; path.resize(is_top ? 0 : path.rfind('/'))) {
    is_top = path.size() <= 1;
    const std::string folder = is_top ? root : root + path;
    double quota_us = 0.0;
    double period_us = 0.0;
    // "200000 100000" are two cores, "max 100000" is no limit.
    if (std::ifstream(folder + "/cpu.max") >> quota_us >> period_us && period_us > 0.0) {
      tighten(limits.cores, quota_us / period_us);
    }
    std::uint64_t bytes = 0;
    if (std::ifstream(folder + "/memory.max") >> bytes) {
      tighten(limits.memory_bytes, bytes);
    }
  }
  return limits;
}

LimitsOfGroup limits_of_group() {
  std::ifstream own("/proc/self/cgroup");
  return limits_of_group("/sys/fs/cgroup", {std::istreambuf_iterator<char>(own), {}});
}

std::uint64_t available_memory_bytes() {
  constexpr std::uint64_t kKibibyte = 1024;
  std::uint64_t bytes = std::uint64_t{2} << 30U;  // if the system does not say
  std::ifstream words("/proc/meminfo");
  for (std::string word; words >> word;) {
    if (std::uint64_t kibibytes = 0; word == "MemAvailable:" && words >> kibibytes) {
      bytes = kKibibyte * kibibytes;
    }
  }
  return std::min(bytes, limits_of_group().memory_bytes.value_or(bytes));
}

}  // namespace oblique::protocol
