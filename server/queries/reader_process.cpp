#include "server/queries/reader_process.h"

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
#include "server/queries/reader_program.h"

namespace oblique::server {
namespace {

/// A killed process is gone at once, unless the system itself hangs on its disk.
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
  kill();
  const auto give_up = std::chrono::steady_clock::now() + kLongestEnd;
  while (!is_gone() && std::chrono::steady_clock::now() < give_up) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ::close(channel_);
}

void ReaderProcess::ask(const std::string& request) {
  const auto length = static_cast<FrameLength>(request.size());
  out_.assign(reinterpret_cast<const char*>(&length), sizeof length);
  out_ += request;
  sent_ = 0;
  in_.clear();
  state_ = State::kWorking;
}

short ReaderProcess::events() const {
  const bool sends = state_ == State::kWorking && sent_ < out_.size();
  return static_cast<short>(sends ? POLLIN | POLLOUT : POLLIN);
}

ReaderProcess::State ReaderProcess::advance() {
  if (state_ != State::kAnswered && state_ != State::kEnded && (!send_some() || !receive_some())) {
    state_ = State::kEnded;
  }
  return state_;
}

/// False when the process is gone.
bool ReaderProcess::send_some() {
  while (sent_ < out_.size()) {
    const ssize_t sent = ::send(channel_, out_.data() + sent_, out_.size() - sent_, MSG_NOSIGNAL);
    if (sent >= 0) {
      sent_ += static_cast<std::size_t>(sent);
    } else if (errno != EINTR) {
      return errno == EAGAIN;
    }
  }
  return true;
}

/// False when the process is gone, or says what no reader says.
bool ReaderProcess::receive_some() {
  std::array<char, kReadBytes> bytes;
  while (look_for_frame()) {
    if (state_ == State::kAnswered) {
      return true;
    }
    const ssize_t got = ::recv(channel_, bytes.data(), bytes.size(), 0);
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got <= 0) {
      return got < 0 && errno == EAGAIN;
    }
    in_.append(bytes.data(), static_cast<std::size_t>(got));
  }
  return false;
}

/// Answered when `in_` begins with a whole frame. False when no reader says what it begins with.
bool ReaderProcess::look_for_frame() {
  if (in_.size() < sizeof(AnswerHead)) {
    return in_.empty() || state_ == State::kWorking;
  }
  const std::size_t length = head().length;
  if (state_ != State::kWorking || length > protocol::kMaxFrameBytes) {
    return false;
  }
  if (in_.size() >= sizeof(AnswerHead) + length) {
    state_ = State::kAnswered;
  }
  return true;
}

AnswerHead ReaderProcess::head() const {
  AnswerHead head{};
  std::memcpy(&head, in_.data(), sizeof head);
  return head;
}

ReaderAnswer ReaderProcess::take_answer() {
  ReaderAnswer answer{head(), {}};
  answer.reply = in_.substr(sizeof answer.head, answer.head.length);
  in_.erase(0, sizeof answer.head + answer.head.length);
  if (answer.head.ends == 0) {
    state_ = State::kWorking;
  } else {
    out_ = {};
    sent_ = 0;
    state_ = State::kIdle;
  }
  return answer;
}

void ReaderProcess::kill() {
  // Waited for here and nowhere else, so the number cannot have passed to another process.
  if (!is_gone()) {
    ::kill(pid_, SIGKILL);
  }
}

bool ReaderProcess::is_gone() {
  if (!gone_) {
    gone_ = waitpid(pid_, &status_, WNOHANG) == pid_;
  }
  return gone_;
}

std::string ReaderProcess::ending() const {
  if (WIFSIGNALED(status_)) {
    const int signal = WTERMSIG(status_);
    return "was killed by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
  }
  return "ended with exit code " + std::to_string(WEXITSTATUS(status_));
}

}  // namespace oblique::server
