#include "client/output/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace oblique::client {

bool draws_on_terminal() {
  return isatty(STDERR_FILENO) == 1;
}

bool may_colour(int descriptor) {
  const auto of_environment = [](const char* variable) {
    const char* value = std::getenv(variable);
    return std::string_view(value == nullptr ? "" : value);
  };
  const std::string_view terminal = of_environment("TERM");
  return isatty(descriptor) == 1 && of_environment("NO_COLOR").empty() && !terminal.empty() &&
         terminal != "dumb";
}

std::size_t terminal_columns() {
  constexpr std::size_t kUnlessTold = 80;
  struct winsize size {};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col
                                                                         : kUnlessTold;
}

}  // namespace oblique::client
