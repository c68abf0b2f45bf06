#include "tests/support/process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "tests/support/hang_limit.h"

namespace oblique::test {
namespace {

constexpr std::chrono::milliseconds kPollInterval{2};

/// Returns the contents of a file in /proc; empty if the process has ended.
std::string contents(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// State letter and parent of a process, as in /proc/PID/stat.
struct ProcessState {
  char state;
  pid_t parent;
};
std::optional<ProcessState> state_of(pid_t pid) {
  const std::string stat = contents("/proc/" + std::to_string(pid) + "/stat");
  const std::size_t name_end = stat.rfind(')');  // the program's name may contain `)`
  if (name_end == std::string::npos) {
    return std::nullopt;
  }
  std::istringstream rest(stat.substr(name_end + 1));
  ProcessState state{};
  rest >> state.state >> state.parent;
  return rest ? std::optional(state) : std::nullopt;
}

/// Returns the environment of this process with `changes`, each variable as NAME=value. Variables
/// of oblique's programs and of systemd are removed.
std::vector<std::string> environment_with(const Environment& changes) {
  std::vector<std::string> all;
  // Installed configuration files must not affect tests.
  Environment set{{"OBLIQUE_SERVER_CONFIG", "/dev/null"}, {"OBLIQUE_WORKER_CONFIG", "/dev/null"}};
  for (const auto& [name, value] : changes) {
    set[name] = value;
  }
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string text = *variable;
    const std::string name = text.substr(0, text.find('='));
    const bool is_ours = name.starts_with("OBLIQUE_") || name == "NOTIFY_SOCKET" ||
                         name == "WATCHDOG_USEC" || name == "WATCHDOG_PID" ||
                         name == "JOURNAL_STREAM";
    if (!is_ours && !set.contains(name)) {
      all.push_back(text);
    }
  }
  for (const auto& [name, value] : set) {
    all.push_back(name + "=" + value);
  }
  return all;
}

/// Null-terminated list of pointers to `texts`, for system calls.
std::vector<char*> pointers_to(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) {
    pointers.push_back(text.data());
  }
  pointers.push_back(nullptr);
  return pointers;
}

std::vector<pid_t> all_processes() {
  std::vector<pid_t> all;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") == std::string::npos) {
      all.push_back(static_cast<pid_t>(std::stol(name)));
    }
  }
  return all;
}

}  // namespace

void wait_until(const std::string& what, const std::function<bool()>& condition) {
  const auto give_up = std::chrono::steady_clock::now() + kHangLimit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > give_up) {
      throw std::runtime_error("timeout while waiting for: " + what);
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

bool is_running(pid_t pid) {
  const auto state = state_of(pid);
  return state && state->state != 'Z' && state->state != 'X';
}

std::vector<pid_t> children_of(pid_t pid) {
  std::vector<pid_t> children;
  for (const pid_t child : all_processes()) {
    const auto state = state_of(child);
    if (state && state->parent == pid) {
      children.push_back(child);
    }
  }
  return children;
}

std::vector<pid_t> processes_of(const TemporaryFolder& folder) {
  std::vector<pid_t> found;
  for (const pid_t pid : all_processes()) {
    const std::string environment = contents("/proc/" + std::to_string(pid) + "/environ");
    if (environment.find(folder.path().string()) != std::string::npos) {
      found.push_back(pid);
    }
  }
  return found;
}

Process::Process(const TemporaryFolder& folder, const std::string& program,
                 const std::vector<std::string>& arguments, const Environment& environment,
                 int ready_fd) {
  std::string base = folder.file("process-XXXXXX");
  const int unique = mkstemp(base.data());
  close(unique);
  out_file_ = base + ".out";
  err_file_ = base + ".err";
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.path().c_str());
  constexpr int kWrite = O_WRONLY | O_CREAT | O_APPEND;
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out_file_.c_str(), kWrite, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err_file_.c_str(), kWrite, 0600);
  if (ready_fd >= 0) {
    posix_spawn_file_actions_adddup2(&actions, ready_fd, 3);
  }
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<std::string> variables = environment_with(environment);
  const int error = posix_spawn(&pid_, program.c_str(), &actions, &attributes,
                                pointers_to(words).data(), pointers_to(variables).data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    throw std::runtime_error(program + ": " + std::strerror(error));
  }
}

Process::~Process() {
  if (!reap()) {
    kill(pid_, SIGKILL);
    int status = 0;
    waitpid(pid_, &status, 0);
  }
}

void Process::send(int signal) const {
  kill(pid_, signal);
}

bool Process::reap() {
  if (!exit_code_) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }
  }
  return exit_code_.has_value();
}

std::optional<int> Process::exit_code() {
  reap();
  return exit_code_;
}

int Process::wait() {
  wait_until("the end of process " + std::to_string(pid_) + "; its output: " + err(),
             [this] { return reap(); });
  return *exit_code_;
}

std::string Process::out() const {
  return contents(out_file_);
}
std::string Process::err() const {
  return contents(err_file_);
}

Outcome Process::outcome() {
  const int code = wait();
  return {code, out(), err()};
}

}  // namespace oblique::test
