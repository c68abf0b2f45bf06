#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <string.h>

namespace oblique::test {

/// A range of addresses of this process, from /proc/self/smaps.
struct MappedRange {
  std::uintptr_t begin = 0;
  std::uintptr_t end = 0;
  bool is_writable = false;
  std::string flags;  ///< for example " rd wr mr mw me dd lo ", see proc(5)

  bool has(std::string_view flag) const {
    return flags.find(" " + std::string(flag) + " ") != std::string::npos;
  }
  bool contains(const void* place) const {
    const auto address = reinterpret_cast<std::uintptr_t>(place);
    return begin <= address && address < end;
  }
};

inline std::vector<MappedRange> mapped_ranges() {
  std::vector<MappedRange> ranges;
  std::ifstream smaps("/proc/self/smaps");
  for (std::string line; std::getline(smaps, line);) {
    constexpr std::string_view kFlags = "VmFlags:";
    if (line.starts_with(kFlags)) {
      ranges.back().flags = line.substr(kFlags.size()) + " ";
    } else if (line.find('-') < line.find(' ')) {
      MappedRange range;
      std::string permissions;
      char dash = 0;
      std::istringstream(line) >> std::hex >> range.begin >> dash >> range.end >> permissions;
      range.is_writable = permissions.starts_with("rw");
      ranges.push_back(range);
    }
  }
  return ranges;
}

/// True unless a sanitizer forbids reading all memory of the process.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kAllMemoryMayBeRead = false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kAllMemoryMayBeRead = false;
#else
inline constexpr bool kAllMemoryMayBeRead = true;
#endif
#else
inline constexpr bool kAllMemoryMayBeRead = true;
#endif

/// Returns true if a core dump of this process would contain `bytes`. Requires
/// `kAllMemoryMayBeRead`.
inline bool is_in_a_core_dump(std::string_view bytes) {
  for (const MappedRange& range : mapped_ranges()) {
    if (range.is_writable && !range.has("dd") &&
        memmem(reinterpret_cast<const void*>(range.begin), range.end - range.begin, bytes.data(),
               bytes.size()) != nullptr) {
      return true;
    }
  }
  return false;
}

}  // namespace oblique::test
