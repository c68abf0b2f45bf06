#include "proto/system/limits_of_group.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>

namespace oblique::protocol {
namespace {

std::string text_of(const std::string& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

template <class Number>
void tighten(std::optional<Number>& limit, Number other) {
  limit = limit ? std::min(*limit, other) : other;
}

/// Of cpu.max: "200000 100000" are two cores, "max 100000" is no limit.
void take_cores(LimitsOfGroup& limits, const std::string& quota_and_period) {
  std::istringstream words(quota_and_period);
  double quota_us = 0;
  double period_us = 0;
  if (words >> quota_us >> period_us && quota_us > 0 && period_us > 0) {
    tighten(limits.cores, quota_us / period_us);
  }
}

void take_memory(LimitsOfGroup& limits, const std::string& text) {
  // The first version writes "no limit" as the largest number of whole pages.
  constexpr std::uint64_t kNoLimit = std::uint64_t{1} << 60U;
  std::istringstream words(text);
  std::uint64_t bytes = 0;
  if (words >> bytes && bytes < kNoLimit) {
    tighten(limits.memory_bytes, bytes);
  }
}

/// The group's path in the line of `controller` ("" for version 2), as "0::/user.slice".
std::optional<std::string> path_of(const std::string& own, const std::string& controller) {
  std::istringstream lines(own);
  for (std::string line; std::getline(lines, line);) {
    const auto first = line.find(':');
    const auto second = line.find(':', first + 1);
    if (second == std::string::npos) {
      continue;
    }
    std::istringstream names(line.substr(first + 1, second - first - 1));
    bool is_meant = controller.empty() && second == first + 1;
    for (std::string name; std::getline(names, name, ',');) {
      is_meant = is_meant || name == controller;
    }
    if (is_meant) {
      return line.substr(second + 1);
    }
  }
  return std::nullopt;
}

}  // namespace

LimitsOfGroup limits_of_group(const std::string& root, const std::string& own) {
  LimitsOfGroup limits;
  for (const std::string controller : {"", "cpu", "memory"}) {
    const std::string top = controller.empty() ? root : root + '/' + controller;
    std::optional<std::string> path = path_of(own, controller);
    // In a container the path may be that of the machine, which does not exist there; the top does.
    for (bool is_done = !path; !is_done;) {
      is_done = path->size() <= 1;
      const std::string folder = is_done ? top : top + *path;
      take_cores(limits, text_of(folder + "/cpu.max"));
      take_cores(limits,
                 text_of(folder + "/cpu.cfs_quota_us") + text_of(folder + "/cpu.cfs_period_us"));
      take_memory(limits, text_of(folder + "/memory.max"));
      take_memory(limits, text_of(folder + "/memory.limit_in_bytes"));
      path->resize(is_done ? 0 : path->rfind('/'));
    }
  }
  return limits;
}

LimitsOfGroup limits_of_group() {
  return limits_of_group("/sys/fs/cgroup", text_of("/proc/self/cgroup"));
}

std::uint64_t available_memory_bytes() {
  constexpr std::uint64_t kKibibyte = 1024;
  constexpr std::uint64_t kUnknown = std::uint64_t{2} << 30U;
  constexpr std::string_view kName = "MemAvailable:";
  std::uint64_t bytes = 0;
  std::ifstream lines("/proc/meminfo");
  for (std::string line; bytes == 0 && std::getline(lines, line);) {
    if (line.starts_with(kName)) {
      bytes = kKibibyte * std::strtoull(line.c_str() + kName.size(), nullptr, 10);
    }
  }
  bytes = bytes == 0 ? kUnknown : bytes;
  return std::min(bytes, limits_of_group().memory_bytes.value_or(bytes));
}

}  // namespace oblique::protocol
