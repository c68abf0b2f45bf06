// Who is not read, or not accepted, while more has come than is taken.
#include <sys/epoll.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

#include "server/network/network.h"

namespace oblique::server {
namespace {

/// Of the time for a handshake, after which the oldest makes room. Half of this is too short for
/// thousands of one busy process. Those who never finish keep others waiting.
constexpr std::int64_t kPartOfTime = 10;
constexpr const char* kTooManyOfSource = "its address has too many handshakes under way";

}  // namespace

bool Network::has_more() const {
  return has_unopened_ || !handshakes_.empty() ||
         std::any_of(ports_.begin(), ports_.end(), [this](const OpenPort& port) {
           return !port.paused.empty() && !is_full(port);
         });
}

bool Network::has_unheard(const std::string& identity) const {
  const Peer* const peer = find(identity);
  // A trace on a slow line takes longer to come than a worker may be silent.
  constexpr std::int64_t kPauseInAMessage_ms = 1000;
  const auto is_coming = [&] {
    return peer->connection.held_in_bytes() > 0 &&
           now_ms_ - peer->last_heard_ms < kPauseInAMessage_ms;
  };
  return peer != nullptr && (peer->stands_in_line || peer->is_paused || is_coming());
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

bool Network::has_had(Number stranger, std::int64_t part, std::int64_t now_ms) const {
  return now_ms - peers_.at(stranger)->since_ms >= limits_.handshake_ms / part;
}

/// As many handshakes are under way as may be, and the oldest has not had its time. Who is ended
/// comes again at once: of a crowd that is slow nobody would ever get in.
bool Network::must_newcomers_wait(std::int64_t now_ms) const {
  return strangers_.size() >= limits_.handshakes &&
         !has_had(*strangers_.begin(), kPartOfTime, now_ms);
}

/// Whether one more handshake of that source may begin; a connection that waited in the system
/// would keep those of other sources waiting. Of too many the oldest is ended once it has had its
/// time, else one of the newest: most finish even when all are slow, and a fast one soon gets in
/// beside many that never finish.
bool Network::has_room_for(const PeerAddress& address, std::int64_t now_ms) {
  constexpr std::size_t kPartForNewest = 8;
  constexpr std::int64_t kPartOfTimeOfNewest = 100;
  const auto found = strangers_of_.find(address.source());
  if (found == strangers_of_.end() || found->second.size() < limits_.handshakes_of_source) {
    return true;
  }
  const std::set<Number>& strangers = found->second;
  const auto newest = static_cast<std::ptrdiff_t>(strangers.size() / kPartForNewest);
  const Number one_of_newest = *std::prev(strangers.end(), newest + 1);
  if (has_had(*strangers.begin(), kPartOfTime, now_ms)) {
    end(*strangers.begin(), kTooManyOfSource, RefusalCause::kBound);
  } else if (has_had(one_of_newest, kPartOfTimeOfNewest, now_ms)) {
    end(one_of_newest, kTooManyOfSource, RefusalCause::kBound);
  } else {
    count_refusal(RefusalCause::kBound, address.text(), kTooManyOfSource);
    return false;
  }
  return true;
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
