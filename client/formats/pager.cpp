#include "client/formats/pager.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <iostream>
#include <utility>

#include "client/io/console.h"
#include "proto/text.h"

namespace oblique::client {

std::string pager_command() {
  for (const char* name : {"OBLIQUE_PAGER", "PAGER"}) {
    if (const auto command = environment_variable(name)) {
      return *command == "cat" ? std::string() : *command;
    }
  }
  return "less -FRSX";
}

PagedOutput::PagedOutput(std::size_t lines, std::string command)
    : lines_left_(lines), command_(std::move(command)) {
  std::cout.flush();
}

PagedOutput::~PagedOutput() {
  wait();
}

void PagedOutput::start() {
  std::array<int, 2> ends{};
  pager_ = 0;
  if (command_.empty() || ::pipe2(ends.data(), O_CLOEXEC) != 0) {
    return;
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  // A pager that is not there is none; what it is given is printed then.
  std::string script = "command -v ${0%% *} >/dev/null 2>&1 || exec cat; eval \"$0\"";
  std::array<std::string, 4> words{"sh", "-c", std::move(script), command_};
  std::array<char*, 5> arguments{words[0].data(), words[1].data(), words[2].data(), words[3].data(),
                                 nullptr};
  pid_t pager = 0;
  if (posix_spawnp(&pager, "sh", &actions, nullptr, arguments.data(), environ) == 0) {
    pager_ = pager;
    pipe_ = ends[1];
    // Who leaves the pager has seen enough, and writing to it fails then. Ctrl-C is the pager's,
    // which has the terminal.
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGINT, SIG_IGN);
  } else {
    ::close(ends[1]);
  }
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[0]);
}

void PagedOutput::write(std::string_view bytes) {
  const std::string text = protocol::visible_lines(std::string(bytes));
  if (pager_ < 0) {
    const auto lines = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
    first_ += text;
    if (lines < lines_left_) {
      lines_left_ -= lines;
      return;
    }
    start();
    write_all(pipe_ < 0 ? STDOUT_FILENO : pipe_, std::exchange(first_, {}), "standard output");
    return;
  }
  write_all(pipe_ < 0 ? STDOUT_FILENO : pipe_, text, "standard output");
}

void PagedOutput::finish() {
  flush();
  write_all(STDOUT_FILENO, std::exchange(first_, {}), "standard output");
  wait();
}

void PagedOutput::wait() {
  if (pipe_ < 0) {
    return;
  }
  ::close(std::exchange(pipe_, -1));
  while (::waitpid(pager_, nullptr, 0) < 0 && errno == EINTR) {
  }
  std::signal(SIGINT, SIG_DFL);
}

}  // namespace oblique::client
