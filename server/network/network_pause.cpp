// Who is not read, or not accepted, while more has come than is taken.
#include <sys/epoll.h>

#include <algorithm>
#include <utility>

#include "server/network/network.h"

namespace oblique::server {

bool Network::has_more() const {
  return has_unopened_ || !handshakes_.empty() ||
         std::any_of(ports_.begin(), ports_.end(), [this](const OpenPort& port) {
           return !port.paused.empty() && !is_full(port);
         });
}

bool Network::has_unheard(const std::string& identity) const {
  const Peer* const peer = find(identity);
  return peer != nullptr && (peer->stands_in_line || peer->is_paused);
}

void Network::read_paused_again() {
  for (OpenPort& port : ports_) {
    if (port.paused.empty() || is_full(port)) {
      continue;
    }
    for (const Number number : std::exchange(port.paused, {})) {
      if (const auto found = peers_.find(number); found != peers_.end()) {
        found->second->is_paused = false;
        settle(number, *found->second);
      }
    }
  }
}

/// As many handshakes are under way as may be, and the oldest has not had its time. Who is ended
/// comes again at once: of a crowd that is slow nobody would ever get in.
bool Network::must_newcomers_wait(std::int64_t now_ms) {
  // Half of this is too short for thousands of one busy process. Those who never finish keep others
  // waiting.
  constexpr std::int64_t kPartOfTime = 10;
  if (handshakes_under_way_ < limits_.handshakes) {
    return false;
  }
  for (; !strangers_.empty(); strangers_.pop_front()) {
    const auto oldest = peers_.find(strangers_.front());
    if (oldest != peers_.end() && oldest->second->is_stranger) {
      return now_ms - oldest->second->since_ms < limits_.handshake_ms / kPartOfTime;
    }
  }
  return false;
}

void Network::let_newcomers_wait(Port port) {
  ports_[port].is_closed = true;
  epoll_event event{0, {.u64 = port}};
  epoll_ctl(epoll_.number(), EPOLL_CTL_MOD, ports_[port].listener->descriptor(), &event);
}

void Network::accept_again(std::int64_t now_ms) {
  for (Port port = 0; port < ports_.size(); ++port) {
    if (ports_[port].is_closed && !must_newcomers_wait(now_ms)) {
      ports_[port].is_closed = false;
      epoll_event event{EPOLLIN, {.u64 = port}};
      epoll_ctl(epoll_.number(), EPOLL_CTL_MOD, ports_[port].listener->descriptor(), &event);
    }
  }
}

}  // namespace oblique::server
