#include "proto/program/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <string>
#include <system_error>

#include "proto/text.h"

namespace oblique::protocol {
namespace {

bool is_ignored(int signal) {
  struct sigaction action {};
  return sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

void check_call(bool is_done, const char* what) {
  if (!is_done) {
    throw std::system_error(errno, std::generic_category(), what);
  }
}

/// Handles an exception that nothing catches. Errors other than a lack of memory or threads abort.
[[noreturn]] void end_process() {
  const auto uncaught = std::current_exception();
  try {
    uncaught ? std::rethrow_exception(uncaught) : std::abort();
  } catch (const std::exception& error) {
    const char* const text = failure_text(error);
    dprintf(STDERR_FILENO, "%s: %s\n", program_invocation_short_name, text);
    text != error.what() ? _exit(1) : std::abort();
  }
}

}  // namespace

std::string environment_value(const std::string& name) {
  const char* const value = name.empty() ? nullptr : std::getenv(name.c_str());
  return value == nullptr ? "" : value;
}

void prepare_process(rlim_t wanted_files) {
  int null = STDIN_FILENO;
  while (null >= 0 && null <= STDERR_FILENO) {
    null = ::open("/dev/null", O_RDWR);
  }
  ::close(null);
  std::signal(SIGXFSZ, SIG_IGN);
  std::set_terminate(end_process);
  rlimit files{};
  constexpr rlim_t kLeastFiles = 64;
  static_cast<void>(getrlimit(RLIMIT_NOFILE, &files));
  files.rlim_cur = std::max(files.rlim_cur, std::min(wanted_files, files.rlim_max));
  if (setrlimit(RLIMIT_NOFILE, &files) == 0 && files.rlim_cur < kLeastFiles) {
    dprintf(STDERR_FILENO, "%s: the limit on open files (ulimit -n) is %d; %d are needed\n",
            program_invocation_short_name, static_cast<int>(files.rlim_cur), int{kLeastFiles});
    _exit(1);
  }
}

const char* failure_text(const std::exception& error) {
  const auto* const failure = dynamic_cast<const std::system_error*>(&error);
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr
             ? "out of memory: raise the limit of this process (ulimit -v) or of its container"
         : failure != nullptr && failure->code() == std::errc::resource_unavailable_try_again
             ? "no further thread can be started: raise the limit on processes (ulimit -u) or on "
               "memory (ulimit -v)"
             : error.what();
}

StopSignals::StopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  if (!is_ignored(SIGHUP)) {
    sigaddset(&signals, SIGHUP);
  }
  descriptor_ = Descriptor(signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC));
  check_call(descriptor_.is_open(), "cannot watch for signals");
  pthread_sigmask(SIG_BLOCK, &signals, &before_);
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

void add_stop_with_parent(CLI::App& app, pid_t& parent) {
  app.add_option("--stop-with-parent", parent,
                 "Stop when the parent process, which has this ID, has ended")
      ->check(CLI::Range(pid_t{1}, std::numeric_limits<pid_t>::max()).description(""))
      ->type_name("PID")
      ->default_str("")
      ->configurable(false);
}

bool stop_with_parent(pid_t parent) {
  if (parent == 0) {
    return true;
  }
  check_call(prctl(PR_SET_PDEATHSIG, SIGTERM) == 0, "cannot watch the parent process");
  return getppid() == parent;  // if the parent has already ended, the system sends no signal
}

Notifier::Notifier(int forwarder)
    : forwarder_(forwarder),
      socket_(environment_value("NOTIFY_SOCKET")),
      heartbeat_(std::chrono::microseconds(std::atoll(environment_value("WATCHDOG_USEC").c_str())) /
                 2) {}

void Notifier::ready(const std::string& sentence) const {
  send("READY=1\nSTATUS=" + visible(sentence));
}

void Notifier::status(const std::string& sentence) {
  if (sentence != status_) {
    status_ = sentence;
    send("STATUS=" + visible(sentence));
  }
}

void Notifier::stopping(const std::string& sentence, std::chrono::milliseconds longest) const {
  send("STOPPING=1\nSTATUS=" + visible(sentence) +
       "\nEXTEND_TIMEOUT_USEC=" + std::to_string(std::chrono::microseconds(longest).count()));
}

void Notifier::feed_watchdog(Clock::time_point now) {
  if (heartbeat_.count() > 0 && now >= next_heartbeat_) {
    next_heartbeat_ = now + heartbeat_;
    send("WATCHDOG=1");
  }
}

void Notifier::send(std::string_view state) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket_.empty() || socket_.size() >= sizeof(address.sun_path)) {
    return;
  }
  if (forwarder_ >= 0) {
    (void)::send(forwarder_, state.data(), state.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return;
  }
  std::memcpy(address.sun_path, socket_.data(), socket_.size());
  auto length = static_cast<socklen_t>(sizeof(address));
  if (socket_.front() == '@') {  // an abstract name, whose length counts
    address.sun_path[0] = '\0';
    length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_.size());
  }
  const Descriptor sender(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  (void)::sendto(sender.number(), state.data(), state.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                 reinterpret_cast<const sockaddr*>(&address), length);
}

}  // namespace oblique::protocol
