#include "client/verbs/doctor/machine.h"

#include <gnu/libc-version.h>
#include <langinfo.h>
#include <locale.h>
#include <sys/resource.h>
#include <sys/timex.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string_view>
#include <thread>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "proto/system/limits_of_group.h"
#include "proto/text.h"
#include "worker/solver/solve.h"

namespace oblique::client::doctor {
namespace {

/// What follows `name` and its separator in the first such line of a file of /proc or /etc.
std::string value_in(const std::string& file, std::string_view name, char separator) {
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    const auto at = line.find(separator);
    if (at != std::string::npos && line.starts_with(name) &&
        line.find_first_not_of(" \t", name.size()) == at) {
      const auto begin = line.find_first_not_of(" \t\"", at + 1);
      const auto end = line.find_last_not_of(" \t\"");
      return begin == std::string::npos ? "" : line.substr(begin, end - begin + 1);
    }
  }
  return {};
}

std::uint64_t memory_bytes(std::string_view name) {
  constexpr std::uint64_t kKibibyte = 1024;
  return std::strtoull(value_in("/proc/meminfo", name, ':').c_str(), nullptr, 10) * kKibibyte;
}

void add_system(Findings& found, bool with_host_name) {
  utsname system{};
  uname(&system);
  std::string distribution = value_in("/etc/os-release", "PRETTY_NAME", '=');
  if (distribution.empty()) {
    distribution = "unknown distribution";
  }
  found.add("system", fmt::format("{}; Linux {}, {}; glibc {}", distribution, system.release,
                                  system.machine, gnu_get_libc_version()));
  if (with_host_name) {
    found.add("host", system.nodename);
  }
}

void add_processor(Findings& found) {
  constexpr std::array<std::string_view, 8> kSets{"sse2", "avx",     "avx2",     "fma",
                                                  "bmi2", "avx512f", "avx512dq", "avx512vl"};
  const std::string flags = ' ' + value_in("/proc/cpuinfo", "flags", ':') + ' ';
  auto sets = nlohmann::ordered_json::array();
  std::string listed;
  for (const std::string_view set : kSets) {
    if (flags.find(fmt::format(" {} ", set)) != std::string::npos) {
      sets.push_back(set);
      listed += fmt::format(" {}", set);
    }
  }
  std::string model = value_in("/proc/cpuinfo", "model name", ':');
  if (model.empty()) {
    model = "model not told";
  }
  found.add("processor", model);
  found.add(
      "instruction_sets", "instructions",
      fmt::format("{}; the solver takes {}", listed.empty() ? "none is told" : listed.substr(1),
                  solver::instruction_set()),
      sets);
  found.note("solver_takes", solver::instruction_set());
}

void add_cores(Findings& found) {
  const long online = sysconf(_SC_NPROCESSORS_ONLN);
  const unsigned allowed = std::thread::hardware_concurrency();
  const auto group = protocol::limits_of_group();
  std::array<double, 3> load{};
  const bool has_load = getloadavg(load.data(), 3) == 3;
  std::string text = fmt::format("{} of the machine's {}", allowed, online);
  if (group.cores) {
    text += fmt::format("; the control group grants {:.3g}", *group.cores);
  }
  if (has_load) {
    text += fmt::format("; load {:.1f} over the last minute", load[0]);
  }
  found.add("cores", "cores", text, allowed);
  found.note("cores_online", online);
  found.note("cores_of_group", group.cores ? nlohmann::ordered_json(*group.cores) : nullptr);
  found.note("load", has_load ? nlohmann::ordered_json(load[0]) : nullptr);
  if (group.cores && *group.cores < allowed) {
    found.odd.push_back(fmt::format(
        "Workers take {} threads here by themselves, and the control group grants {:.3g} cores: "
        "give oblique-worker --threads {}.",
        allowed, *group.cores, std::max(1.0, std::ceil(*group.cores))));
  }
  constexpr double kCrowded = 1.5;
  if (has_load && load[0] > kCrowded * std::max(1U, allowed)) {
    found.odd.push_back(fmt::format(
        "Others use this machine: load {:.1f} on {} cores. All takes longer; results are the same.",
        load[0], allowed));
  }
}

void add_memory(Findings& found) {
  const std::uint64_t total = memory_bytes("MemTotal");
  const std::uint64_t available = memory_bytes("MemAvailable");
  const auto group = protocol::limits_of_group();
  rlimit address_space{};
  getrlimit(RLIMIT_AS, &address_space);
  std::string text =
      fmt::format("{}, {} of it available", shown_bytes(total), shown_bytes(available));
  if (group.memory_bytes) {
    text += fmt::format("; the control group grants {}", shown_bytes(*group.memory_bytes));
  }
  const bool is_limited = address_space.rlim_cur != RLIM_INFINITY;
  if (is_limited) {
    text += fmt::format("; limited to {} (ulimit -v)", shown_bytes(address_space.rlim_cur));
  }
  found.add("memory_bytes", "memory", text, total);
  found.note("memory_available_bytes", available);
  found.note("memory_of_group_bytes",
             group.memory_bytes ? nlohmann::ordered_json(*group.memory_bytes) : nullptr);
  constexpr std::uint64_t kLittle = 300'000'000;
  if (available > 0 && available < kLittle) {
    found.odd.push_back(
        fmt::format("Little memory is left ({}): server and worker may be ended by the system. "
                    "End something else, or give the worker fewer --threads.",
                    shown_bytes(available)));
  }
  if (is_limited && address_space.rlim_cur < 4 * kLittle) {
    found.odd.push_back(
        "ulimit -v bounds addresses, not memory, and ends programs that take "
        "little: say `ulimit -v unlimited` before.");
  }
}

void add_clock(Findings& found) {
  timex clock{};
  const int state = adjtimex(&clock);
  const bool is_known = state >= 0;
  const bool is_set =
      is_known && state != TIME_ERROR && (static_cast<unsigned>(clock.status) & STA_UNSYNC) == 0;
  const std::time_t now = std::time(nullptr);
  tm utc{};
  gmtime_r(&now, &utc);
  const std::string time =
      fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", utc.tm_year + 1900, utc.tm_mon + 1,
                  utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec);
  found.add("clock", "clock",
            fmt::format("{}, {}", time,
                        !is_known ? "whether it is kept right is not told"
                        : is_set  ? "kept right by the network"
                                  : "not kept right by the network, as far as the kernel knows"),
            time);
  found.note("clock_synchronised", is_known ? nlohmann::ordered_json(is_set) : nullptr);
  constexpr int kYearOfThis = 2025;
  if (utc.tm_year + 1900 < kYearOfThis) {
    found.odd.push_back(
        fmt::format("The clock says {}: set it, for times of results come from it.", time));
  }
}

void add_locale(Findings& found) {
  std::string wanted = variable("LC_ALL");
  for (const char* name : {"LC_CTYPE", "LANG"}) {
    wanted = wanted.empty() ? variable(name) : wanted;
  }
  locale_t locale = newlocale(LC_CTYPE_MASK, "", nullptr);
  const std::string codes =
      locale == nullptr ? std::string("not installed") : nl_langinfo_l(CODESET, locale);
  if (locale != nullptr) {
    freelocale(locale);
  } else {
    found.odd.push_back(fmt::format(
        "The locale {} is not installed here; oblique does without. C.UTF-8 always is there.",
        wanted));
  }
  found.add("locale", fmt::format("{} ({})", wanted.empty() ? "none is set" : wanted, codes));
}

}  // namespace

Findings examine_machine(bool with_host_name) {
  Findings found{"machine", "machine"};
  add_system(found, with_host_name);
  add_processor(found);
  add_cores(found);
  add_memory(found);
  add_clock(found);
  add_locale(found);
  return found;
}

}  // namespace oblique::client::doctor
