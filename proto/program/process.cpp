#include "proto/program/process.h"

#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <system_error>

#include "proto/text.h"

namespace oblique::protocol {
namespace {

[[noreturn]] void fail(int error, const char* what) {
  throw std::system_error(error, std::generic_category(), what);
}

bool is_ignored(int signal) {
  struct sigaction action {};
  return sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

/// Empty for the id of a process and for an empty text.
std::string objection_to_process(const std::string& text) {
  pid_t process = 0;
  return text.empty() || (CLI::detail::lexical_cast(text, process) && process > 0)
             ? ""
             : "\"" + text + "\" is no process id";
}

/// Removes the variable and returns its value; empty when there is none.
std::string taken(const char* name) {
  const char* const value = std::getenv(name);
  std::string kept = value == nullptr ? "" : value;
  unsetenv(name);
  return kept;
}

}  // namespace

StopSignals::StopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  if (!is_ignored(SIGHUP)) {
    sigaddset(&signals, SIGHUP);
  }
  descriptor_ = Descriptor(signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC));
  if (!descriptor_.is_open()) {
    fail(errno, "cannot watch for signals");
  }
  if (const int error = pthread_sigmask(SIG_BLOCK, &signals, &before_); error != 0) {
    fail(error, "cannot block signals");
  }
}

StopSignals::~StopSignals() {
  (void)requested();
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

bool StopSignals::requested() {
  signalfd_siginfo received{};
  while (read(descriptor(), &received, sizeof(received)) == sizeof(received)) {
    signal_ = signal_ == 0 ? static_cast<int>(received.ssi_signo) : signal_;
  }
  return signal_ > 0;
}

bool StopSignals::wait(std::chrono::nanoseconds longest) {
  if (signal_ > 0) {
    return true;
  }
  const auto left = std::clamp<std::int64_t>(
      std::chrono::ceil<std::chrono::milliseconds>(longest).count(), 0, INT32_MAX);
  pollfd item{descriptor(), POLLIN, 0};
  static_cast<void>(poll(&item, 1, static_cast<int>(left)));
  return requested();
}

void survive_failed_writes() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

StopWithParent::StopWithParent() : parent_(getppid()) {}

void StopWithParent::add_to(CLI::App& app) {
  option_ = app.add_option("--stop-with-parent", named_,
                           "Stop when the parent process is gone; with its id, also when it was "
                           "before this one began")
                ->expected(0, 1)
                ->check(objection_to_process)
                ->type_name("[PID]")
                ->default_str("")  // none: the option may stand alone
                ->configurable(false);
}

bool StopWithParent::is_wanted() const {
  return option_ != nullptr && option_->count() > 0;
}

bool StopWithParent::begin() const {
  if (!is_wanted()) {
    return true;
  }
  if (prctl(PR_SET_PDEATHSIG, SIGTERM) != 0) {
    throw std::system_error(errno, std::generic_category(), "cannot watch the parent process");
  }
  // The system does not report a parent that has ended already.
  return getppid() == (named_ > 0 ? named_ : parent_);
}

Notifier::Notifier() : socket_(taken("NOTIFY_SOCKET")) {
  const std::int64_t within_us = std::atoll(taken("WATCHDOG_USEC").c_str());
  const std::string watched = taken("WATCHDOG_PID");
  if (within_us > 0 && (watched.empty() || watched == std::to_string(getpid()))) {
    heartbeat_ = std::chrono::microseconds(within_us) / 2;
  }
}

void Notifier::ready(const std::string& sentence) {
  status_ = sentence;
  send("READY=1\nSTATUS=" + visible(sentence));
}

void Notifier::status(const std::string& sentence) {
  if (sentence != status_) {
    status_ = sentence;
    send("STATUS=" + visible(sentence));
  }
}

void Notifier::stopping(const std::string& sentence, std::chrono::milliseconds longest) {
  status_ = sentence;
  send("STOPPING=1\nSTATUS=" + visible(sentence) +
       "\nEXTEND_TIMEOUT_USEC=" + std::to_string(std::chrono::microseconds(longest).count()));
}

void Notifier::turn(Clock::time_point now) {
  if (heartbeat_ && now >= next_heartbeat_) {
    next_heartbeat_ = now + *heartbeat_;
    send("WATCHDOG=1");
  }
}

void Notifier::send(const std::string& state) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const bool is_abstract = socket_.starts_with('@');
  if (socket_.size() < 2 || socket_.size() >= sizeof(address.sun_path) ||
      (!is_abstract && !socket_.starts_with('/'))) {
    return;
  }
  std::memcpy(address.sun_path, socket_.data(), socket_.size());
  if (is_abstract) {
    address.sun_path[0] = '\0';
  }
  const Descriptor sender(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  // A path ends with a zero byte, an abstract name with its length.
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_.size() +
                                             (is_abstract ? 0 : 1));
  (void)::sendto(sender.number(), state.data(), state.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                 reinterpret_cast<const sockaddr*>(&address), length);
}

}  // namespace oblique::protocol
