#include "client/io/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <string_view>
#include <thread>

#include <spdlog/fmt/fmt.h>

namespace oblique::client {
namespace {

Descriptor memory_file(std::string_view text = {}) {
  Descriptor file(memfd_create("oblique", MFD_CLOEXEC));
  const auto written = ::write(file.number(), text.data(), text.size());
  if (written != static_cast<ssize_t>(text.size())) {
    throw ProcessError(fmt::format("cannot create a file in memory: {}", std::strerror(errno)));
  }
  lseek(file.number(), 0, SEEK_SET);
  return file;
}

std::size_t bytes_in(const Descriptor& file) {
  struct stat about {};
  return file.is_open() && fstat(file.number(), &about) == 0
             ? static_cast<std::size_t>(about.st_size)
             : 0;
}

/// Reads an in-memory file from byte `from` to its end.
std::string text_in(const Descriptor& file, std::size_t from) {
  std::string text(bytes_in(file) - from, '\0');
  const auto got = pread(file.number(), text.data(), text.size(), static_cast<off_t>(from));
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, got)));
  return text;
}

/// Returns our environment without the variables whose names begin with `hidden`. If `hidden` is
/// empty, returns all variables.
std::vector<char*> environment_without(const std::string& hidden) {
  std::vector<char*> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (hidden.empty() || !std::string_view(*variable).starts_with(hidden)) {
      variables.push_back(*variable);
    }
  }
  variables.push_back(nullptr);
  return variables;
}

/// Starts `settings.program` with these descriptors as standard streams. -1 means /dev/null for
/// input, and our own stream for outputs. The child starts with no signals blocked. Returns 0 or an
/// error number.
int spawn(const ChildSettings& settings, int input, int output, int errors, pid_t& pid) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const auto duplicate = [&actions](int from, int to) {
    if (from >= 0) {
      posix_spawn_file_actions_adddup2(&actions, from, to);
    }
  };
  if (input < 0) {
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  }
  duplicate(input, STDIN_FILENO);
  duplicate(errors, STDERR_FILENO);
  duplicate(output, STDOUT_FILENO);
  duplicate(settings.handed_over, ChildProcess::kHandedOver);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t signals;
  sigemptyset(&signals);
  posix_spawnattr_setsigmask(&attributes, &signals);
  sigaddset(&signals, SIGXFSZ);  // ignored in this process; another program may expect it
  posix_spawnattr_setsigdefault(&attributes, &signals);
  posix_spawnattr_setpgroup(&attributes, 0);
  const int group = settings.stays_in_our_group ? 0 : POSIX_SPAWN_SETPGROUP;
  posix_spawnattr_setflags(
      &attributes, static_cast<short>(POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | group));
  std::vector<std::string> texts{settings.program.string()};
  texts.insert(texts.end(), settings.arguments.begin(), settings.arguments.end());
  std::vector<char*> arguments;
  for (auto& text : texts) {
    arguments.push_back(text.data());
  }
  arguments.push_back(nullptr);
  const int error =
      posix_spawnp(&pid, settings.program.c_str(), &actions, &attributes, arguments.data(),
                   environment_without(settings.hidden_variables).data());
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  return error;
}

}  // namespace

Pipe::Pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw ProcessError(fmt::format("cannot create a pipe: {}", std::strerror(errno)));
  }
  read = Descriptor(ends[0]);
  write = Descriptor(ends[1]);
}

ChildProcess::ChildProcess(const ChildSettings& settings) {
  if (!settings.show_errors) {
    errors_ = memory_file();
  }
  if (settings.keep_output) {
    output_ = memory_file();
  }
  const Descriptor text = settings.input ? memory_file(*settings.input) : Descriptor();
  // By default the child does not write to our standard output, which is reserved for our data.
  const int output = settings.show_output ? -1
                     : output_.is_open()  ? output_.number()
                                          : STDERR_FILENO;
  const int error = spawn(settings, text.is_open() ? text.number() : settings.input_from, output,
                          errors_.number(), pid_);
  if (error != 0) {
    pid_ = -1;
    const auto what =
        fmt::format("cannot start {}: {}", settings.program.string(), std::strerror(error));
    if (error == ENOENT) {
      throw ProgramNotFound(what);
    }
    throw ProcessError(what);
  }
}

ChildProcess::~ChildProcess() {
  if (pid_ >= 0) {
    send(SIGKILL);
    wait();
  }
}

bool ChildProcess::has_ended(bool waits) {
  int status = 0;
  pid_t ended = 0;
  while (!status_ && (ended = waitpid(pid_, &status, waits ? 0 : WNOHANG)) < 0 && errno == EINTR) {
  }
  if (!status_ && ended == pid_) {
    status_ = status;
  }
  return status_.has_value();
}

void ChildProcess::send(int signal) {
  // Only this function reaps the child, so its process number cannot belong to another process yet.
  if (is_running()) {
    kill(pid_, signal);
  }
}

bool ChildProcess::succeeded() const {
  return status_ && WIFEXITED(*status_) && WEXITSTATUS(*status_) == 0;
}

std::string ChildProcess::ending() const {
  if (!status_) {
    return "is running";
  }
  if (WIFSIGNALED(*status_)) {
    const int signal = WTERMSIG(*status_);
    return fmt::format("was killed by signal {} ({})", signal, strsignal(signal));
  }
  return fmt::format("ended with exit code {}", WEXITSTATUS(*status_));
}

std::string ChildProcess::last_output() const {
  constexpr std::size_t kMaxBytes = 4000;
  constexpr int kMaxLines = 12;
  const std::size_t bytes = bytes_in(errors_);
  std::string text = text_in(errors_, bytes - std::min(bytes, kMaxBytes));
  while (!text.empty() && text.back() == '\n') {
    text.pop_back();
  }
  std::size_t start = text.size();
  for (int lines = 0; lines < kMaxLines && start != std::string::npos && start > 0; ++lines) {
    start = text.rfind('\n', start - 1);
  }
  return start == std::string::npos || start == 0 ? text : text.substr(start + 1);
}

std::string ChildProcess::output(std::size_t most_bytes) const {
  if (const std::size_t bytes = bytes_in(output_); bytes > most_bytes) {
    throw ProcessError(fmt::format("it wrote {} bytes; at most {} are allowed", bytes, most_bytes));
  }
  return text_in(output_, 0);
}

std::string output_of(ChildSettings settings, const std::function<bool()>& keep_waiting) {
  constexpr std::chrono::milliseconds kPause{5};
  constexpr std::size_t kMaxBytes = std::size_t{16} << 20U;
  settings.keep_output = true;
  ChildProcess child(settings);
  while (child.is_running()) {
    if (keep_waiting && !keep_waiting()) {
      throw ProcessError(fmt::format("stopped waiting for {}", settings.program.string()));
    }
    std::this_thread::sleep_for(kPause);
  }
  if (!child.succeeded()) {
    auto words = child.last_output();
    std::replace(words.begin(), words.end(), '\n', ' ');
    throw ProcessError(fmt::format("{} {}{}{}", settings.program.string(), child.ending(),
                                   words.empty() ? "" : ": ", words));
  }
  return child.output(kMaxBytes);
}

std::filesystem::path sibling_program(const std::string& name) {
  const auto own = std::filesystem::read_symlink("/proc/self/exe");
  auto program = own.parent_path() / name;
  if (access(program.c_str(), X_OK) != 0) {
    throw ProcessError(
        fmt::format("cannot find {}: oblique, oblique-server and oblique-worker must be in the "
                    "same folder; Debian's package {} contains it",
                    program.string(), name));
  }
  return program;
}

}  // namespace oblique::client
