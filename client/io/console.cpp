#include "client/io/console.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iostream>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::client {

std::optional<std::string> environment_variable(const char* name) {
  // getenv is safe here, because no thread sets variables. NOLINTNEXTLINE(concurrency-mt-unsafe)
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

TerminalSize terminal_size(int descriptor) {
  if (isatty(descriptor) != 1) {
    return {};
  }
  struct winsize size {};
  if (ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) {
    return {80, 24};
  }
  return {size.ws_col, size.ws_row};
}

bool may_colour(int descriptor) {
  const std::string terminal = environment_variable("TERM").value_or("dumb");
  return isatty(descriptor) == 1 && environment_variable("NO_COLOR").value_or("").empty() &&
         !terminal.empty() && terminal != "dumb";
}

std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char byte) {
    // True for the first byte of a character.
    return (static_cast<unsigned char>(byte) & 0xc0U) != 0x80U;
  }));
}

std::vector<std::string> wrapped(std::string_view text, std::size_t width) {
  std::vector<std::string> lines(1);
  for (const auto word : protocol::split(text, ' ')) {
    std::string& line = lines.back();
    if (!line.empty() && !word.empty() && width_of(line) + 1 + width_of(word) > width) {
      lines.emplace_back(word);
    } else if (!word.empty()) {
      line.append(line.empty() ? "" : " ").append(word);
    }
  }
  return lines;
}

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

Console Console::of_process() {
  const auto columns = [] {
    const std::size_t found = terminal_size(STDERR_FILENO).columns;
    return found > 0 ? found : Terminal().columns();
  };
  return {std::cout,
          std::cerr,
          {.is_terminal = isatty(STDERR_FILENO) == 1,
           .has_colours = may_colour(STDERR_FILENO),
           .columns = columns}};
}

void Console::note(std::string_view sentence) {
  notes() << protocol::visible(sentence) << '\n';
}

void Console::detail(std::string_view sentence) {
  if (verbosity_ == Verbosity::kVerbose) {
    note(sentence);
  }
}

void Console::error(std::string_view command, std::string_view message) {
  const bool is_coloured = terminal_.has_colours;
  err_ << (is_coloured ? "\x1b[1;31m" : "") << command << ':' << (is_coloured ? "\x1b[0m" : "")
       << ' ' << protocol::visible_lines(message) << '\n';
}

void Console::redraw(std::string_view line) {
  if (can_redraw()) {
    notes() << '\r' << line << "\x1b[K" << std::flush;
  }
}

std::size_t Console::columns() const {
  return std::max<std::size_t>(terminal_.columns(), 2) - 1;
}

}  // namespace oblique::client
