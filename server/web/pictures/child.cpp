#include "server/web/pictures/child.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "proto/system/descriptor.h"
#include "proto/system/spawn_plan.h"

namespace oblique::server {
namespace {

using protocol::Descriptor;

constexpr int kLookEvery_ms = 50;
constexpr int kNiceness = 5;
constexpr std::size_t kMostSaid = 4096;

void check(int error, const std::string& what) {
  if (error != 0) {
    throw std::system_error(error, std::generic_category(), what);
  }
}

struct Pipe {
  Pipe() {
    std::array<int, 2> ends{};
    check(::pipe2(ends.data(), O_CLOEXEC) == 0 ? 0 : errno, "pipe2");
    out = Descriptor(ends[0]);
    in = Descriptor(ends[1]);
    check(::fcntl(ends[0], F_SETFL, O_NONBLOCK) == 0 ? 0 : errno, "fcntl");
  }
  Descriptor out;
  Descriptor in;
};

/// Our environment without our own settings, which are not the child's.
std::vector<char*> environment_of_child() {
  std::vector<char*> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (!std::string_view(*variable).starts_with("OBLIQUE_")) {
      variables.push_back(*variable);
    }
  }
  variables.push_back(nullptr);
  return variables;
}

/// A child and its group, killed at the latest when this goes.
class Child {
 public:
  Child(pid_t pid, const ChildLimits& limits) : pid_(pid) {
    // What the system does not allow, the child goes without.
    static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(pid), kNiceness));
    bound(RLIMIT_CPU, static_cast<rlim_t>(limits.processor.count()));
    bound(RLIMIT_CORE, 0);
    bound(RLIMIT_FSIZE, limits.output_bytes);
    if (limits.memory_bytes > 0) {
      bound(RLIMIT_AS, limits.memory_bytes);
    }
    std::ofstream("/proc/" + std::to_string(pid) + "/oom_score_adj") << 1000;
  }
  ~Child() {
    if (!status_) {
      // Waited for here and nowhere else, so the number cannot have passed to another process.
      ::kill(-pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Nothing: it is still there.
  std::optional<int> status() {
    siginfo_t ended{};
    const int code =
        status_ ? -1
                : ::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT);
    if (code == 0 && ended.si_pid == pid_) {
      ::kill(-pid_, SIGKILL);  // what it left behind; the number is its own until it is waited for
      int status = 0;
      ::waitpid(pid_, &status, 0);
      status_ = status;
    }
    return status_;
  }

 private:
  template <typename Resource>
  void bound(Resource resource, rlim_t most) const {
    const rlimit both{most, most};
    static_cast<void>(::prlimit(pid_, resource, &both, nullptr));
  }

  pid_t pid_;
  std::optional<int> status_;
};

/// Reads what is there, keeps so much of it, and closes at the end. False: it is longer.
bool read_some(Descriptor& from, std::string& into, std::size_t most) {
  std::array<char, std::size_t{64} * 1024> bytes;
  while (from.is_open()) {
    const ssize_t got = ::read(from.number(), bytes.data(), bytes.size());
    if (got < 0) {
      return errno == EAGAIN || errno == EINTR;
    }
    if (got == 0) {
      from = Descriptor();
    }
    const std::size_t fits = std::min(static_cast<std::size_t>(got), most - into.size());
    into.append(bytes.data(), fits);
    if (fits < static_cast<std::size_t>(got)) {
      return false;
    }
  }
  return true;
}

}  // namespace

ChildEnd run_child(const std::string& program, std::vector<std::string> arguments,
                   const ChildLimits& limits, const std::function<bool()>& is_over) {
  Pipe output;
  Pipe errors;
  protocol::SpawnPlan plan;
  plan.give(output.in.number(), STDOUT_FILENO);
  plan.give(errors.in.number(), STDERR_FILENO);
  plan.close_from(STDERR_FILENO + 1);
  Child child(plan.start(program, std::move(arguments), environment_of_child().data()), limits);
  output.in = Descriptor();
  errors.in = Descriptor();
  ChildEnd end;
  while (!child.status() || output.out.is_open() || errors.out.is_open()) {
    if (is_over()) {
      end.kind = ChildEnd::Kind::kStopped;
      return end;
    }
    std::array<pollfd, 2> items{{{output.out.is_open() ? output.out.number() : -1, POLLIN, 0},
                                 {errors.out.is_open() ? errors.out.number() : -1, POLLIN, 0}}};
    const bool is_silent = items[0].fd < 0 && items[1].fd < 0;  // it has only to end
    ::poll(items.data(), items.size(), is_silent ? 1 : kLookEvery_ms);
    if (!read_some(output.out, end.output, limits.output_bytes)) {
      end.kind = ChildEnd::Kind::kTooLong;
      return end;
    }
    // Its first words are enough; the others are read all the same, for nobody could write them.
    static_cast<void>(read_some(errors.out, end.said, kMostSaid));
  }
  const int status = *child.status();
  end.kind = WIFEXITED(status) ? ChildEnd::Kind::kEnded : ChildEnd::Kind::kKilled;
  end.code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
  return end;
}

}  // namespace oblique::server
