#include "client/service/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <spdlog/fmt/fmt.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <string_view>
#include <thread>
#include <utility>

namespace oblique::client {
namespace {

std::string reason(int error_number) {
  return std::strerror(error_number);
}

// A file without a name: it vanishes with its last descriptor, whatever ends us.
Descriptor nameless_file() {
  auto path = (std::filesystem::temp_directory_path() / "oblique-XXXXXX").string();
  Descriptor file(mkostemp(path.data(), O_CLOEXEC | O_APPEND));
  if (file.number() < 0) {
    throw ProcessError(fmt::format("cannot make a file in {}: {}",
                                   std::filesystem::temp_directory_path().string(), reason(errno)));
  }
  unlink(path.c_str());
  return file;
}

// A nameless file that holds `text` and is read from its beginning.
Descriptor file_of(std::string_view text) {
  Descriptor file = nameless_file();
  while (!text.empty()) {
    const auto written = write(file.number(), text.data(), text.size());
    if (written < 0 && errno != EINTR) {
      throw ProcessError(fmt::format("cannot write what a program is to read: {}", reason(errno)));
    }
    text.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(0, written)));
  }
  lseek(file.number(), 0, SEEK_SET);
  return file;
}

// Our environment without the variables whose names begin with `hidden`, unless that is empty.
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

// What a child starts with: the descriptors it gets, no blocked signals, its process group.
class SpawnPlan {
 public:
  SpawnPlan(const ChildSettings& settings, int input, int errors, int output) {
    posix_spawn_file_actions_init(&actions_);
    if (input >= 0) {
      posix_spawn_file_actions_adddup2(&actions_, input, STDIN_FILENO);
    } else {
      posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    }
    if (errors >= 0) {
      posix_spawn_file_actions_adddup2(&actions_, errors, STDERR_FILENO);
    }
    // Standard output is for our data alone.
    posix_spawn_file_actions_adddup2(&actions_, output >= 0 ? output : STDERR_FILENO,
                                     STDOUT_FILENO);
    if (settings.handed_over >= 0) {
      posix_spawn_file_actions_adddup2(&actions_, settings.handed_over, ChildProcess::kHandedOver);
    }
    posix_spawnattr_init(&attributes_);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setpgroup(&attributes_, 0);
    const int group = settings.stays_in_our_group ? 0 : POSIX_SPAWN_SETPGROUP;
    posix_spawnattr_setflags(&attributes_, static_cast<short>(POSIX_SPAWN_SETSIGMASK | group));
  }
  ~SpawnPlan() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  SpawnPlan(const SpawnPlan&) = delete;
  SpawnPlan& operator=(const SpawnPlan&) = delete;

  const posix_spawn_file_actions_t* actions() const { return &actions_; }
  const posix_spawnattr_t* attributes() const { return &attributes_; }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

}  // namespace

Pipe::Pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw ProcessError(fmt::format("cannot make a pipe: {}", reason(errno)));
  }
  read = Descriptor(ends[0]);
  write = Descriptor(ends[1]);
}

ChildProcess::ChildProcess(const ChildSettings& settings) {
  if (!settings.show_errors) {
    errors_ = nameless_file();
  }
  if (settings.keep_output) {
    output_ = nameless_file();
  }
  const Descriptor input = settings.input ? file_of(*settings.input) : Descriptor();
  const SpawnPlan plan(settings, input.number(), errors_.number(), output_.number());
  std::vector<std::string> texts{settings.program.string()};
  texts.insert(texts.end(), settings.arguments.begin(), settings.arguments.end());
  std::vector<char*> arguments;
  for (auto& text : texts) {
    arguments.push_back(text.data());
  }
  arguments.push_back(nullptr);
  auto variables = environment_without(settings.hidden_variables);
  const int error = posix_spawnp(&pid_, settings.program.c_str(), plan.actions(), plan.attributes(),
                                 arguments.data(), variables.data());
  if (error != 0) {
    pid_ = -1;
    const auto what = fmt::format("cannot start {}: {}", settings.program.string(), reason(error));
    if (error == ENOENT) {
      throw ProgramNotFound(what);
    }
    throw ProcessError(what);
  }
}

ChildProcess::~ChildProcess() {
  if (pid_ < 0 || !is_running()) {
    return;
  }
  send(SIGKILL);
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
}

bool ChildProcess::is_running() {
  if (status_) {
    return false;
  }
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) == pid_) {
    status_ = status;
  }
  return !status_;
}

void ChildProcess::send(int signal) {
  // Reaped here and nowhere else, so the number cannot have passed to another process.
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

std::string ChildProcess::last_words() const {
  constexpr off_t kMostBytes = 4000;
  constexpr int kMostLines = 12;
  struct stat about {};
  if (errors_.number() < 0 || fstat(errors_.number(), &about) != 0) {
    return {};
  }
  const off_t from = std::max<off_t>(0, about.st_size - kMostBytes);
  std::string text(static_cast<std::size_t>(about.st_size - from), '\0');
  const auto got = pread(errors_.number(), text.data(), text.size(), from);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, got)));
  while (!text.empty() && text.back() == '\n') {
    text.pop_back();
  }
  std::size_t start = text.size();
  for (int lines = 0; lines < kMostLines && start != std::string::npos && start > 0; ++lines) {
    start = text.rfind('\n', start - 1);
  }
  return start == std::string::npos || start == 0 ? text : text.substr(start + 1);
}

std::string ChildProcess::output(std::size_t most_bytes) const {
  struct stat about {};
  if (output_.number() < 0 || fstat(output_.number(), &about) != 0) {
    return {};
  }
  if (static_cast<std::size_t>(about.st_size) > most_bytes) {
    throw ProcessError(
        fmt::format("it wrote {} bytes, more than the {} allowed", about.st_size, most_bytes));
  }
  std::string text(static_cast<std::size_t>(about.st_size), '\0');
  const auto got = pread(output_.number(), text.data(), text.size(), 0);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, got)));
  return text;
}

std::string output_of(ChildSettings settings, const std::function<bool()>& keep_waiting) {
  constexpr std::chrono::milliseconds kPause{5};
  constexpr std::size_t kMostBytes = std::size_t{16} << 20U;
  settings.keep_output = true;
  ChildProcess child(settings);
  while (child.is_running()) {
    if (keep_waiting && !keep_waiting()) {
      throw ProcessError(fmt::format("stopped waiting for {}", settings.program.string()));
    }
    std::this_thread::sleep_for(kPause);
  }
  if (!child.succeeded()) {
    auto words = child.last_words();
    std::replace(words.begin(), words.end(), '\n', ' ');
    throw ProcessError(fmt::format("{} {}{}{}", settings.program.string(), child.ending(),
                                   words.empty() ? "" : ": ", words));
  }
  return child.output(kMostBytes);
}

std::filesystem::path sibling_program(const std::string& name) {
  const auto own = std::filesystem::read_symlink("/proc/self/exe");
  auto program = own.parent_path() / name;
  if (access(program.c_str(), X_OK) != 0) {
    throw ProcessError(
        fmt::format("cannot find {}: the programs oblique, oblique-server and oblique-worker must "
                    "lie in one folder; of Debian's packages, {} has this one",
                    program.string(), name));
  }
  return program;
}

}  // namespace oblique::client
