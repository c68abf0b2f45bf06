#include "tests/client/verbs/program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace oblique::client {
namespace {

std::string contents(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::filesystem::path fresh_file(const TestFolder& folder) {
  auto path = (folder.path() / "output-XXXXXX").string();
  const int file = mkstemp(path.data());
  if (file < 0) {
    throw std::runtime_error("cannot make " + path);
  }
  close(file);
  return path;
}

// Becomes the program; only calls that are safe after a fork.
[[noreturn]] void become(const char* folder, const char* out, const char* err,
                         char* const* arguments) {
  if (chdir(folder) == 0) {
    dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
    dup2(open(out, O_WRONLY | O_TRUNC), STDOUT_FILENO);
    dup2(open(err, O_WRONLY | O_TRUNC), STDERR_FILENO);
    execv(OBLIQUE_PROGRAM, arguments);
  }
  _exit(127);
}

}  // namespace

TestFolder::TestFolder() {
  auto path = (std::filesystem::temp_directory_path() / "oblique-test-XXXXXX").string();
  if (mkdtemp(path.data()) == nullptr) {
    throw std::runtime_error("cannot make " + path);
  }
  path_ = path;
}

TestFolder::~TestFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

Program::Program(const TestFolder& folder, const std::vector<std::string>& arguments)
    : out_(fresh_file(folder)), err_(fresh_file(folder)) {
  unsetenv("OBLIQUE_SERVER");
  std::vector<std::string> texts{OBLIQUE_PROGRAM};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> words;
  for (auto& text : texts) {
    words.push_back(text.data());
  }
  words.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    become(folder.path().c_str(), out_.c_str(), err_.c_str(), words.data());
  }
}

Program::~Program() {
  if (!ended_) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
}

std::vector<pid_t> Program::children() const {
  const auto number = std::to_string(pid_);
  std::istringstream list(contents("/proc/" + number + "/task/" + number + "/children"));
  return {std::istream_iterator<pid_t>(list), {}};
}

std::string Program::err() const {
  return contents(err_);
}

Outcome Program::outcome() {
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  ended_ = true;
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(out_), contents(err_)};
}

Outcome oblique(const TestFolder& folder, const std::vector<std::string>& arguments) {
  return Program(folder, arguments).outcome();
}

Outcome oblique(const std::vector<std::string>& arguments) {
  const TestFolder folder;
  return oblique(folder, arguments);
}

}  // namespace oblique::client
