#include "proto/program/notify.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "proto/system/descriptor.h"
#include "proto/text.h"

namespace oblique::protocol {
namespace {

/// The value of the variable, which is gone afterwards; empty when there is none.
std::string taken(const char* name) {
  const char* const value = std::getenv(name);
  std::string kept = value == nullptr ? "" : value;
  unsetenv(name);
  return kept;
}

std::int64_t number_in(const std::string& text) {
  std::int64_t value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value);
  return error == std::errc() && end == last ? value : 0;
}

}  // namespace

Notifier::Notifier() : socket_(taken("NOTIFY_SOCKET")) {
  const std::int64_t within_us = number_in(taken("WATCHDOG_USEC"));
  const std::string watched = taken("WATCHDOG_PID");
  if (within_us > 0 && (watched.empty() || number_in(watched) == getpid())) {
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
    // Half of the time is between two; turns come several times a second.
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
