#include "client/io/sink.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::client {
namespace {

constexpr const char* kName = "standard output";

/// Empty: no pager is wanted.
std::string pager_command() {
  for (const char* name : {"OBLIQUE_PAGER", "PAGER"}) {
    if (const char* command = std::getenv(name); command != nullptr) {
      return std::string_view(command) == "cat" ? std::string() : std::string(command);
    }
  }
  return "less -FRSX";
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
      throw std::runtime_error(
          fmt::format("{} could not be written: {}", name, std::strerror(errno)));
    }
  }
}

TerminalSize terminal_size() {
  constexpr TerminalSize kUsual{80, 24};
  if (isatty(STDOUT_FILENO) != 1) {
    return {};
  }
  struct winsize size {};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) {
    return kUsual;
  }
  return {size.ws_col, size.ws_row};
}

StandardOutput::StandardOutput(bool may_page)
    : is_terminal_(isatty(STDOUT_FILENO) == 1),
      pager_command_(may_page && is_terminal_ ? pager_command() : std::string()) {
  std::cout.flush();
}

StandardOutput::~StandardOutput() {
  wait_for_pager();
}

void StandardOutput::append(std::string_view bytes) {
  if (!is_terminal_) {
    write_all(STDOUT_FILENO, bytes, kName);
    return;
  }
  const std::string text = protocol::visible_lines(bytes);
  if (pager_command_.empty() || pager_ != nullptr) {
    write_all(pager_ == nullptr ? STDOUT_FILENO : to_pager_.number(), text, kName);
    return;
  }
  first_screen_ += text;
  const auto lines = std::count(first_screen_.begin(), first_screen_.end(), '\n');
  if (static_cast<std::size_t>(lines) + 1 >= terminal_size().lines) {
    start_pager();
    write_all(to_pager_.number(), std::exchange(first_screen_, {}), kName);
  }
}

void StandardOutput::start_pager() {
  Pipe pipe;
  pager_ = std::make_unique<ChildProcess>(ChildSettings{
      .program = "sh",
      // A program that is not installed does not page: its text is printed.
      .arguments = {"-c", "command -v ${0%% *} >/dev/null 2>&1 || exec cat; eval \"$0\"",
                    pager_command_},
      .show_errors = true,
      .stays_in_our_group = true,
      .input_from = pipe.read.number(),
      .show_output = true});
  to_pager_ = std::move(pipe.write);
  // Writing fails once the user has left the pager. Ctrl-C belongs to the pager.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGINT, SIG_IGN);
}

void StandardOutput::finish() {
  write_all(STDOUT_FILENO, std::exchange(first_screen_, {}), kName);
  wait_for_pager();
}

void StandardOutput::wait_for_pager() {
  if (to_pager_.is_open()) {
    to_pager_.close();
    pager_->wait();
    std::signal(SIGINT, SIG_DFL);
  }
}

}  // namespace oblique::client
