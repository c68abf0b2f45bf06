#include "client/io/console.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>

#include "proto/text.h"

namespace oblique::client {

std::optional<std::string> environment_variable(const char* name) {
  // No thread sets variables.
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

TerminalSize terminal_size(int descriptor) {
  constexpr TerminalSize kUsual{80, 24};
  if (isatty(descriptor) != 1) {
    return {};
  }
  struct winsize size {};
  if (ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) {
    return kUsual;
  }
  return {size.ws_col, size.ws_row};
}

bool may_colour(int descriptor) {
  const std::string terminal = environment_variable("TERM").value_or("dumb");
  return isatty(descriptor) == 1 && environment_variable("NO_COLOR").value_or("").empty() &&
         !terminal.empty() && terminal != "dumb";
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

}  // namespace oblique::client
