#include "server/query/reader_process.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "proto/frames.h"
#include "proto/system/descriptor.h"
#include "proto/system/spawn_plan.h"
#include "server/query/reader_program.h"

namespace oblique::server {
namespace {

/// Longest wait for the end of a killed process, which ends late only if it waits for a disk.
constexpr std::chrono::milliseconds kLongestEnd{500};
constexpr std::size_t kReadBytes = 64 * 1024;

void check(int error, const std::string& what) {
  if (error != 0) {
    throw std::system_error(error, std::generic_category(), what);
  }
}

}  // namespace

ReaderProcess::ReaderProcess(const std::string& program, const std::string& path) {
  std::array<int, 2> ends{};
  check(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) == 0 ? 0 : errno,
        "socketpair");
  protocol::Descriptor ours(ends[0]);
  const protocol::Descriptor theirs(ends[1]);
  check(fcntl(ours.number(), F_SETFL, O_NONBLOCK) == 0 ? 0 : errno, "fcntl");
  protocol::SpawnPlan plan;
  plan.give(theirs.number(), kReaderChannel);
  plan.give(STDERR_FILENO, STDOUT_FILENO);
  plan.close_from(kReaderChannel + 1);
  pid_ = plan.start(program, {"oblique-reader", kReadMode, path}, environ);
  channel_ = ours.release();
}

ReaderProcess::~ReaderProcess() {
  end();
  ::close(channel_);
}

void ReaderProcess::ask(const std::string& request) {
  const FrameHead head{static_cast<std::uint32_t>(request.size()), 1};
  out_.assign(reinterpret_cast<const char*>(&head), sizeof head);
  out_ += request;
  is_asked_ = true;
  is_broken_ = !send_some();
}

short ReaderProcess::events() const {
  return static_cast<short>(out_.empty() ? POLLIN : POLLIN | POLLOUT);
}

std::optional<ReaderProcess::Frame> ReaderProcess::read() {
  is_broken_ = is_broken_ || !send_some();
  while (!is_broken_) {
    FrameHead head{};
    if (in_.size() >= sizeof head) {
      std::memcpy(&head, in_.data(), sizeof head);
      if (!is_asked_ || head.length > protocol::kMaxFrameBytes) {
        is_broken_ = true;
        return std::nullopt;
      }
      if (in_.size() >= sizeof head + head.length) {
        Frame frame{in_.substr(sizeof head, head.length), head.is_last != 0};
        in_.erase(0, sizeof head + head.length);
        is_asked_ = !frame.is_last;
        return frame;
      }
    }
    if (!receive_some()) {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

/// False when the process has closed the channel.
bool ReaderProcess::send_some() {
  while (!out_.empty()) {
    const ssize_t sent = ::send(channel_, out_.data(), out_.size(), MSG_NOSIGNAL);
    if (sent >= 0) {
      out_.erase(0, static_cast<std::size_t>(sent));
    } else if (errno != EINTR) {
      return errno == EAGAIN;
    }
  }
  return true;
}

/// False when nothing was received.
bool ReaderProcess::receive_some() {
  std::array<char, kReadBytes> bytes;
  while (true) {
    const ssize_t got = ::recv(channel_, bytes.data(), bytes.size(), 0);
    if (got > 0) {
      in_.append(bytes.data(), static_cast<std::size_t>(got));
      return true;
    }
    if (got == 0 || errno != EINTR) {
      is_broken_ = got == 0 || errno != EAGAIN;
      return false;
    }
  }
}

void ReaderProcess::kill() {
  // Only this class waits for the process, so its id cannot have been reused.
  if (!is_gone()) {
    ::kill(pid_, SIGKILL);
  }
}

std::string ReaderProcess::end() {
  kill();
  const auto give_up = std::chrono::steady_clock::now() + kLongestEnd;
  while (!is_gone() && std::chrono::steady_clock::now() < give_up) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (WIFSIGNALED(status_)) {
    const int signal = WTERMSIG(status_);
    return "was killed by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
  }
  return "ended with exit code " + std::to_string(WEXITSTATUS(status_));
}

bool ReaderProcess::is_gone() {
  if (!is_gone_) {
    is_gone_ = waitpid(pid_, &status_, WNOHANG) == pid_;
  }
  return is_gone_;
}

}  // namespace oblique::server
