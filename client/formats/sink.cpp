#include "client/formats/sink.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::client {
namespace {

std::string reason_of(int error) {
  return std::strerror(error);
}

}  // namespace

void write_all(int descriptor, std::string_view bytes, const std::string& name) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EPIPE) {
      throw ClosedPipe();
    } else if (errno != EINTR) {
      throw std::runtime_error(fmt::format("{} could not be written: {}", name, reason_of(errno)));
    }
  }
}

void Sink::flush() {
  // What cannot be written is not tried again.
  std::string bytes = std::exchange(held_, {});
  write(bytes);
  bytes.clear();
  held_ = std::move(bytes);  // with its room
}

StandardOutput::StandardOutput() : is_terminal_(isatty(STDOUT_FILENO) == 1) {
  std::cout.flush();
}

void StandardOutput::write(std::string_view bytes) {
  constexpr const char* kName = "standard output";
  if (is_terminal_) {
    write_all(STDOUT_FILENO, protocol::visible_lines(bytes), kName);
  } else {
    write_all(STDOUT_FILENO, bytes, kName);
  }
}

}  // namespace oblique::client
