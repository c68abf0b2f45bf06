#include "tests/bench/process_usage.h"

#include <unistd.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace oblique::bench {
namespace {

/// Returns the CPU time [s], user plus system, in a `stat` file of /proc; 0 without a file.
double cpu_s_of(const std::string& file) {
  std::ifstream stat(file);
  const std::string text((std::istreambuf_iterator<char>(stat)), std::istreambuf_iterator<char>());
  if (text.empty()) {
    return 0.0;
  }
  std::istringstream fields(text.substr(text.rfind(')') + 1));
  std::string skipped;
  for (int i = 0; i < 11; ++i) {
    fields >> skipped;
  }
  double user_ticks = 0.0;
  double system_ticks = 0.0;
  fields >> user_ticks >> system_ticks;
  return (user_ticks + system_ticks) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

}  // namespace

Usage usage_of(pid_t pid) {
  const std::string number = std::to_string(pid);
  const std::string folder = "/proc/" + number;
  Usage usage;
  usage.cpu_s = cpu_s_of(folder + "/stat");
  usage.first_thread_cpu_s = cpu_s_of(folder + "/task/" + number + "/stat");
  std::ifstream status(folder + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) {
      usage.peak_MB = std::stod(line.substr(6)) / 1024.0;
    } else if (line.starts_with("VmRSS:")) {
      usage.resident_MB = std::stod(line.substr(6)) / 1024.0;
    }
  }
  return usage;
}

}  // namespace oblique::bench
