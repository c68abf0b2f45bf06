#include "server/web/process_numbers.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <system_error>

#include <sys/resource.h>
#include <unistd.h>

namespace oblique::server {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// The field of that number, counted from 0, of a text of fields; NaN where there is none.
double field_of(const std::string& text, int number) {
  std::istringstream fields(text);
  std::string skipped;
  for (int i = 0; i < number; ++i) {
    fields >> skipped;
  }
  double value = kUnknown;
  return fields >> value ? value : kUnknown;
}

std::string text_of_file(const char* path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

double began_s() {
  // What follows the name of the program, which may have any character; proc(5) numbers from 1.
  const std::string stat = text_of_file("/proc/self/stat");
  constexpr int kStartTime = 22 - 3;
  const double after_boot_ticks = field_of(stat.substr(stat.rfind(')') + 1), kStartTime);
  const std::string all = text_of_file("/proc/stat");
  const std::string key = "\nbtime ";
  const std::size_t at = all.find(key);
  const double boot_s = at == std::string::npos ? kUnknown : field_of(all.substr(at + 1), 1);
  return boot_s + after_boot_ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double open_descriptors() {
  std::error_code error;
  double count = 0.0;
  for (auto entry = std::filesystem::directory_iterator("/proc/self/fd", error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    ++count;
  }
  return error ? kUnknown : count - 1.0;  // without the one by which they are read
}

double bytes_of(const std::string& file, double if_missing) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file, error);
  return error ? if_missing : static_cast<double>(bytes);
}

}  // namespace

ProcessNumbers process_numbers() {
  rusage usage{};
  const bool has_usage = getrusage(RUSAGE_SELF, &usage) == 0;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  rlimit limit{};
  const bool has_limit = getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
  constexpr int kResident = 1;
  return {has_usage ? seconds(usage.ru_utime) + seconds(usage.ru_stime) : kUnknown,
          field_of(text_of_file("/proc/self/statm"), kResident) *
              static_cast<double>(sysconf(_SC_PAGESIZE)),
          open_descriptors(), has_limit ? static_cast<double>(limit.rlim_cur) : kUnknown,
          began_s()};
}

DiskNumbers disk_numbers(const std::string& database) {
  std::error_code error;
  const auto space =
      std::filesystem::space(std::filesystem::absolute(database, error).parent_path(), error);
  return {bytes_of(database, kUnknown), bytes_of(database + "-wal", 0.0),
          error ? kUnknown : static_cast<double>(space.available)};
}

}  // namespace oblique::server
