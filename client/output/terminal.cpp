#include "client/output/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

namespace oblique::client {

bool draws_on_terminal() {
  return isatty(STDERR_FILENO) == 1;
}

std::size_t terminal_columns() {
  constexpr std::size_t kUnlessTold = 80;
  struct winsize size {};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col
                                                                         : kUnlessTold;
}

}  // namespace oblique::client
