#include "proto/system/resources.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <vector>

#include <spdlog/fmt/fmt.h>

namespace oblique::protocol {
namespace {

/// Returns the folders that may have limits of `controller`, from this process's control group up
/// to the root. In a container the path may be valid only on the host, so some folders may be
/// missing.
std::vector<std::string> group_folders(const std::string& root, const std::string& controller) {
  std::vector<std::string> folders;
  std::ifstream lines(root + "/proc/self/cgroup");
  for (std::string number, names, path;
       std::getline(std::getline(std::getline(lines, number, ':'), names, ':'), path);) {
    // Version 2 has no names of controllers.
    if (names.empty() || (',' + names + ',').find(',' + controller + ',') != std::string::npos) {
      const std::string mount = root + "/sys/fs/cgroup" + (names.empty() ? "" : "/") + names;
      for (; path.size() > 1; path.resize(path.rfind('/'))) {
        folders.push_back(mount + path);
      }
      folders.push_back(mount);
    }
  }
  return folders;
}

}  // namespace

std::uint64_t available_memory_bytes(const std::string& root) {
  constexpr std::uint64_t kKibibyte = 1024;
  std::uint64_t bytes = std::uint64_t{2} << 30U;  // used if the free memory is unknown
  std::ifstream words(root + "/proc/meminfo");
  for (std::string word; words >> word;) {
    if (std::uint64_t kibibytes = 0; word == "MemAvailable:" && words >> kibibytes) {
      bytes = kKibibyte * kibibytes;
    }
  }
  for (const std::string& folder : group_folders(root, "memory")) {
    if (std::uint64_t limit = 0; std::ifstream(folder + "/memory.max") >> limit) {
      bytes = std::min(bytes, limit);
    }
  }
  return bytes;
}

Processors usable_processors(const std::string& root) {
  Processors usable{.count = static_cast<unsigned>(std::max(1L, sysconf(_SC_NPROCESSORS_ONLN)))};
  cpu_set_t mask{};
  if (sched_getaffinity(0, sizeof mask, &mask) == 0 &&
      CPU_COUNT(&mask) < static_cast<int>(usable.count)) {
    usable = {static_cast<unsigned>(CPU_COUNT(&mask)),
              "the affinity mask of this process, as taskset sets it, has no others"};
  }
  for (const std::string& folder : group_folders(root, "cpu")) {
    double quota_us = 0.0;  // "max" or -1 means none
    double period_us = 0.0;
    const bool has_quota = std::ifstream(folder + "/cpu.max") >> quota_us >> period_us ||
                           (std::ifstream(folder + "/cpu.cfs_quota_us") >> quota_us &&
                            std::ifstream(folder + "/cpu.cfs_period_us") >> period_us);
    const double count = std::max(1.0, std::ceil(quota_us / period_us));
    if (has_quota && quota_us > 0.0 && period_us > 0.0 && count < usable.count) {
      usable = {static_cast<unsigned>(count),
                fmt::format("the quota of {} is {:g} processors", folder, quota_us / period_us)};
    }
  }
  return usable;
}

}  // namespace oblique::protocol
