#include "client/io/format_units.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/number.h"

namespace oblique::client {

std::string format_duration(double seconds) {
  if (seconds < 9.95) {
    return fmt::format("{} s", solver::fixed_number(std::max(seconds, 0.0), 1));
  }
  const auto whole = static_cast<std::int64_t>(std::llround(std::min(seconds, 1e12)));
  if (whole < 60) {
    return fmt::format("{} s", whole);
  }
  if (whole < 3600) {
    return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  }
  if (whole < 86400) {
    return fmt::format("{} h {:02} min", whole / 3600, whole % 3600 / 60);
  }
  return fmt::format("{} d {:02} h", whole / 86400, whole % 86400 / 3600);
}

std::string format_count(std::uint64_t count) {
  std::string text = std::to_string(count);
  for (std::size_t place = text.size(); place > 3; place -= 3) {
    text.insert(place - 3, 1, ',');
  }
  return text;
}

std::string counted(std::uint64_t count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", format_count(count), count == 1 ? one : many);
}

std::string format_rate(double per_s) {
  if (!(per_s >= 99.95)) {
    return solver::readable_number(per_s, 3);
  }
  const double capped = std::min(per_s, 1e15);
  const double unit = std::pow(10.0, std::floor(std::log10(capped)) - 2.0);
  return format_count(static_cast<std::uint64_t>(std::llround(std::round(capped / unit) * unit)));
}

std::string format_bytes(std::uint64_t bytes) {
  constexpr std::array kUnits{"kB", "MB", "GB", "TB", "PB", "EB"};
  if (bytes < 1000) {
    return fmt::format("{} bytes", bytes);
  }
  double size = static_cast<double>(bytes) / 1000.0;
  std::size_t unit = 0;
  for (; size >= 999.5 && unit + 1 < kUnits.size(); ++unit) {
    size /= 1000.0;
  }
  return fmt::format("{} {}", solver::fixed_number(size, size < 9.95 ? 1 : 0), kUnits.at(unit));
}

}  // namespace oblique::client
