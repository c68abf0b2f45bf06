#include "tests/system/processes.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <thread>

#include <nlohmann/json.hpp>

namespace oblique::test {
namespace {

constexpr std::chrono::seconds kNeverThatLong{240};
constexpr std::chrono::milliseconds kBetweenLooks{2};

std::string contents(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// State and parent of a process, from /proc; nothing when it is gone.
struct ProcessState {
  char state;
  pid_t parent;
};
std::optional<ProcessState> state_of(pid_t pid) {
  const std::string stat = contents("/proc/" + std::to_string(pid) + "/stat");
  const std::size_t name_end = stat.rfind(')');  // the name before it may hold anything
  if (name_end == std::string::npos) {
    return std::nullopt;
  }
  std::istringstream rest(stat.substr(name_end + 1));
  ProcessState state{};
  rest >> state.state >> state.parent;
  return rest ? std::optional(state) : std::nullopt;
}

/// Our environment with `changes`, each as NAME=value.
std::vector<std::string> environment_with(const Environment& changes) {
  std::vector<std::string> all;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string text = *variable;
    if (!changes.contains(text.substr(0, text.find('=')))) {
      all.push_back(text);
    }
  }
  for (const auto& [name, value] : changes) {
    all.push_back(name + "=" + value);
  }
  return all;
}

/// As system calls take a list of texts; lives as long as they do.
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

std::string read_line(int descriptor) {
  std::string line;
  char byte = 0;
  while (read(descriptor, &byte, 1) == 1 && byte != '\n') {
    line += byte;
  }
  return line;
}

}  // namespace

std::string client_program() {
  return OBLIQUE_CLIENT;
}
std::string server_program() {
  return OBLIQUE_SERVER;
}
std::string worker_program() {
  return OBLIQUE_WORKER;
}

Folder::Folder() {
  std::string path = (std::filesystem::temp_directory_path() / "oblique-test-XXXXXX").string();
  if (mkdtemp(path.data()) == nullptr) {
    throw std::runtime_error("mkdtemp: " + std::string(std::strerror(errno)));
  }
  path_ = path;
}

Folder::~Folder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

void wait_until(const std::string& what, const std::function<bool()>& condition) {
  const auto give_up = std::chrono::steady_clock::now() + kNeverThatLong;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > give_up) {
      throw std::runtime_error("waited in vain: " + what);
    }
    std::this_thread::sleep_for(kBetweenLooks);
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

std::vector<pid_t> processes_of(const Folder& folder) {
  std::vector<pid_t> found;
  for (const pid_t pid : all_processes()) {
    const std::string environment = contents("/proc/" + std::to_string(pid) + "/environ");
    if (environment.find(folder.path().string()) != std::string::npos) {
      found.push_back(pid);
    }
  }
  return found;
}

// ---- Process ----------------------------------------------------------------------------------

Process::Process(const Folder& folder, const std::string& program,
                 const std::vector<std::string>& arguments, const Environment& environment,
                 int ready_fd) {
  std::string base = folder.file("process-XXXXXX");
  const int unique = mkstemp(base.data());
  close(unique);
  output_file_ = base + ".out";
  errors_file_ = base + ".err";
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  constexpr int kWrite = O_WRONLY | O_CREAT | O_APPEND;
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output_file_.c_str(), kWrite, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, errors_file_.c_str(), kWrite, 0600);
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
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
  }
  return exit_code_.has_value();
}

std::optional<int> Process::exit_code() {
  reap();
  return exit_code_;
}

int Process::wait() {
  wait_until("the end of process " + std::to_string(pid_) + ", which said: " + errors(),
             [this] { return reap(); });
  return *exit_code_;
}

std::string Process::output() const {
  return contents(output_file_);
}
std::string Process::errors() const {
  return contents(errors_file_);
}

Ran run_client(const Folder& folder, const std::vector<std::string>& arguments) {
  Process process(folder, client_program(), arguments);
  const int exit_code = process.wait();
  return {exit_code, process.output(), process.errors()};
}

// ---- Server and worker --------------------------------------------------------------------------

Server::Server(const Folder& folder, const std::string& database, const Environment& environment)
    : ports_(std::make_shared<Ports>()) {
  start(folder, database, environment);
}

Server::Server(const Folder& folder, const std::string& database, const Server& before,
               const Environment& environment)
    : ports_(before.ports_) {
  start(folder, database, environment);
}

void Server::start(const Folder& folder, const std::string& database,
                   const Environment& environment) {
  std::array<int, 2> ready{};
  if (pipe2(ready.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("pipe: " + std::string(std::strerror(errno)));
  }
  process_.emplace(folder, server_program(),
                   std::vector<std::string>{
                       "--db", database, "--worker-port", ports_->worker.number(), "--client-port",
                       ports_->client.number(), "--ready-fd", "3", "--stop-with-parent"},
                   environment, ready[1]);
  close(ready[1]);
  const std::string line = read_line(ready[0]);
  close(ready[0]);
  const auto urls = nlohmann::json::parse(line, nullptr, false);
  if (!urls.is_object()) {
    throw std::runtime_error("the server did not start: " + process_->errors());
  }
  worker_url_ = urls.at("worker");
  client_url_ = urls.at("client");
}

namespace {

std::vector<std::string> worker_arguments(const std::string& server_url,
                                          const std::vector<std::string>& more) {
  std::vector<std::string> all{"--server", server_url, "--stop-with-parent"};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

}  // namespace

Worker::Worker(const Folder& folder, const std::string& server_url,
               const std::vector<std::string>& arguments, const Environment& environment)
    : Process(folder, worker_program(), worker_arguments(server_url, arguments), environment) {}

// ---- Database -----------------------------------------------------------------------------------

namespace {

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

/// Calls `take` with each row.
void for_each_row(const std::string& file, const std::string& sql,
                  const std::function<void(sqlite3_stmt*)>& take) {
  sqlite3* opened = nullptr;
  const int open_error = sqlite3_open_v2(file.c_str(), &opened, SQLITE_OPEN_READONLY, nullptr);
  const std::unique_ptr<sqlite3, Close> database(opened);
  const auto check = [&](bool good) {
    if (!good) {
      throw std::runtime_error(file + ": " + sqlite3_errmsg(database.get()) + ": " + sql);
    }
  };
  check(open_error == SQLITE_OK);
  sqlite3_busy_timeout(database.get(), 10'000);
  sqlite3_stmt* prepared = nullptr;
  check(sqlite3_prepare_v2(database.get(), sql.c_str(), -1, &prepared, nullptr) == SQLITE_OK);
  const std::unique_ptr<sqlite3_stmt, Close> statement(prepared);
  int step = 0;
  while ((step = sqlite3_step(statement.get())) == SQLITE_ROW) {
    take(statement.get());
  }
  check(step == SQLITE_DONE);
}

}  // namespace

std::vector<double> Database::numbers(const std::string& sql) const {
  std::vector<double> values;
  for_each_row(file_, sql,
               [&](sqlite3_stmt* row) { values.push_back(sqlite3_column_double(row, 0)); });
  return values;
}

std::vector<std::string> Database::texts(const std::string& sql) const {
  std::vector<std::string> values;
  for_each_row(file_, sql, [&](sqlite3_stmt* row) {
    const void* text = sqlite3_column_blob(row, 0);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row, 0));
    values.emplace_back(text == nullptr ? "" : static_cast<const char*>(text), size);
  });
  return values;
}

double Database::rows() const {
  try {
    return number("SELECT count(*) FROM results");
  } catch (const std::runtime_error&) {
    return 0.0;  // not made yet
  }
}

}  // namespace oblique::test
