#include "server/network/network.h"

#include <poll.h>
#include <sys/epoll.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <system_error>
#include <utility>

namespace oblique::server {
namespace {

/// Numbers below are of ports.
constexpr std::uint64_t kFirstPeer = 16;
/// For the database, its readers and the log.
constexpr std::size_t kOtherDescriptors = 128;
constexpr std::size_t kFewestConnections = 16;
constexpr std::int64_t kLookInterval_ms = 500;
constexpr const char* kLeavesTooMuchUnread = "it leaves too much unread";

/// Most connections for which the system gives descriptors.
std::size_t most_descriptors() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 ||
      limit.rlim_cur < kOtherDescriptors + kFewestConnections) {
    return kFewestConnections;
  }
  return static_cast<std::size_t>(limit.rlim_cur) - kOtherDescriptors;
}

}  // namespace

Network::Network(NetworkLimits limits)
    : limits_(limits), epoll_(epoll_create1(EPOLL_CLOEXEC)), last_number_(kFirstPeer) {
  if (!epoll_.is_open()) {
    throw std::system_error(errno, std::generic_category(), "epoll_create1");
  }
  limits_.connections = std::min(limits_.connections, most_descriptors());
}

Network::~Network() = default;

Network::Port Network::listen(const std::string& address, const std::string& port) {
  const Port number = listeners_.size();
  auto listener = std::make_unique<Listener>(address, port);
  epoll_event event{EPOLLIN, {.u64 = number}};
  if (epoll_ctl(epoll_.number(), EPOLL_CTL_ADD, listener->descriptor(), &event) != 0) {
    throw std::system_error(errno, std::generic_category(), "epoll_ctl");
  }
  listeners_.push_back(std::move(listener));
  lines_.emplace_back();
  return number;
}

// ---- What comes -------------------------------------------------------------------------------

void Network::collect(std::int64_t now_ms) {
  std::array<epoll_event, 256> events;
  const int count = epoll_wait(epoll_.number(), events.data(), static_cast<int>(events.size()), 0);
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    if (event.data.u64 < kFirstPeer) {
      accept_all(event.data.u64, now_ms);
    } else {
      serve(event.data.u64, event.events, now_ms);
    }
  }
  end_the_largest();
  if (now_ms >= next_look_ms_) {
    next_look_ms_ = now_ms + kLookInterval_ms;
    end_unfinished_handshakes(now_ms);
  }
}

void Network::accept_all(Port port, std::int64_t now_ms) {
  constexpr int kMostAtATime = 64;
  for (int i = 0; i < kMostAtATime; ++i) {
    protocol::Descriptor socket = listeners_[port]->accept();
    if (!socket.is_open()) {
      if (errno == EMFILE || errno == ENFILE) {
        make_room(now_ms);
      }
      return;
    }
    if (peers_.size() >= limits_.connections && !make_room(now_ms)) {
      continue;
    }
    const Number number = ++last_number_;
    auto peer = std::make_unique<Peer>(std::move(socket));
    peer->port = port;
    peer->since_ms = peer->last_heard_ms = now_ms;
    Peer& accepted = *peers_.emplace(number, std::move(peer)).first->second;
    watch(number, accepted, EPOLL_CTL_ADD);
    accepted.connection.greet();
    settle(number, accepted);
  }
}

/// Ends the connection that has said nothing for longest, strangers first; false when all are at
/// work.
bool Network::make_room(std::int64_t now_ms) {
  const auto quiet = [](const Peer& peer) {
    return std::pair(peer.connection.is_open(), peer.last_heard_ms);
  };
  const auto quietest =
      std::min_element(peers_.begin(), peers_.end(), [&](const auto& left, const auto& right) {
        return quiet(*left.second) < quiet(*right.second);
      });
  if (quietest == peers_.end() || (quietest->second->connection.is_open() &&
                                   now_ms - quietest->second->last_heard_ms < limits_.active_ms)) {
    return false;
  }
  end(quietest->first, "it was silent for longest, and there are too many connections");
  return true;
}

void Network::serve(Number number, std::uint32_t events, std::int64_t now_ms) {
  const auto found = peers_.find(number);
  if (found == peers_.end()) {
    return;
  }
  Peer& peer = *found->second;
  Connection& connection = peer.connection;
  if ((events & EPOLLOUT) != 0) {
    connection.flush();
  }
  const bool has_ended = (events & (EPOLLHUP | EPOLLERR)) != 0;
  if (connection.has_message()) {
    if (has_ended) {
      peer.is_ending = true;
      epoll_ctl(epoll_.number(), EPOLL_CTL_DEL, connection.descriptor(), nullptr);
    }
  } else if (has_ended || (events & EPOLLIN) != 0) {
    peer.last_heard_ms = now_ms;
    if (connection.read() == Connection::Read::kEnd) {
      end(number, "");
      return;
    }
    if (!connection.fault().empty()) {
      end(number, connection.fault());
      return;
    }
  }
  settle(number, peer);
  if (peer.waiting_out_bytes > limits_.waiting_out_bytes) {
    end(number, kLeavesTooMuchUnread);
  }
}

/// After anything happened to a peer: its sums, its place in the line, what is awaited of it.
void Network::settle(Number number, Peer& peer) {
  Connection& connection = peer.connection;
  held_in_bytes_ += connection.held_in_bytes() - peer.held_in_bytes;
  waiting_out_bytes_ += connection.waiting_out_bytes() - peer.waiting_out_bytes;
  peer.held_in_bytes = connection.held_in_bytes();
  peer.waiting_out_bytes = connection.waiting_out_bytes();
  if (connection.has_message() && !peer.stands_in_line) {
    peer.stands_in_line = true;
    lines_[peer.port].push_back(number);
  }
  if (!connection.can_send()) {
    depart(number, peer, "");
  }
  if (!peer.is_ending) {
    watch(number, peer, EPOLL_CTL_MOD);
  }
}

/// A peer with a message that was not taken is read no further.
void Network::watch(Number number, Peer& peer, int operation) {
  const Connection& connection = peer.connection;
  const std::uint32_t events = (connection.has_message() ? 0U : EPOLLIN) |
                               (connection.waiting_out_bytes() > 0 ? EPOLLOUT : 0U);
  if (operation == EPOLL_CTL_MOD && events == peer.watched_events) {
    return;
  }
  peer.watched_events = events;
  epoll_event event{events, {.u64 = number}};
  epoll_ctl(epoll_.number(), operation, connection.descriptor(), &event);
}

std::optional<Incoming> Network::next(Port port, const MayTake& may_take) {
  std::deque<Number>& line = lines_[port];
  for (std::size_t left = line.size(); left > 0; --left) {
    const Number number = line.front();
    line.pop_front();
    const auto found = peers_.find(number);
    if (found == peers_.end()) {
      continue;
    }
    Peer& peer = *found->second;
    std::string identity = std::to_string(number);
    if (!may_take(identity)) {
      line.push_back(number);
      continue;
    }
    Incoming incoming{std::move(identity), peer.connection.take_message()};
    peer.stands_in_line = false;
    if (peer.is_ending) {
      read_to_the_end(number, peer);
    } else if (!peer.connection.has_message() && !peer.connection.fault().empty()) {
      end(number, peer.connection.fault());
    } else {
      settle(number, peer);
    }
    return incoming;
  }
  return std::nullopt;
}

// ---- What goes --------------------------------------------------------------------------------

Network::Peer* Network::find(const std::string& identity) const {
  Number number = 0;
  std::from_chars(identity.data(), identity.data() + identity.size(), number);
  const auto found = peers_.find(number);
  return found == peers_.end() ? nullptr : found->second.get();
}

Delivery Network::send(const std::string& identity, std::string_view body) {
  Peer* const peer = find(identity);
  if (peer == nullptr || !peer->connection.can_send()) {
    return Delivery::kGone;
  }
  const Number number = std::stoull(identity);
  peer->connection.send(body);
  settle(number, *peer);
  if (peer->waiting_out_bytes > limits_.waiting_out_bytes) {
    end(number, kLeavesTooMuchUnread);
    return Delivery::kGone;
  }
  if (!peer->connection.can_send()) {
    return Delivery::kGone;
  }
  return peer->waiting_out_bytes > limits_.busy_bytes ? Delivery::kBusy : Delivery::kSent;
}

bool Network::is_busy(const std::string& identity) const {
  const Peer* const peer = find(identity);
  return peer != nullptr && peer->waiting_out_bytes > limits_.busy_bytes;
}

bool Network::is_connected(const std::string& identity) const {
  return find(identity) != nullptr;
}

void Network::flush(std::chrono::milliseconds longest) {
  using Clock = std::chrono::steady_clock;
  const auto until = Clock::now() + longest;
  while (Clock::now() < until) {
    std::vector<pollfd> waiting;
    for (const auto& [number, peer] : peers_) {
      peer->connection.flush();
      if (peer->connection.waiting_out_bytes() > 0) {
        waiting.push_back({peer->connection.descriptor(), POLLOUT, 0});
      }
    }
    if (waiting.empty()) {
      return;
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now());
    poll(waiting.data(), waiting.size(), static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
  }
}

// ---- Ends -------------------------------------------------------------------------------------

/// The system has nothing more of this peer than what can be read at once.
void Network::read_to_the_end(Number number, Peer& peer) {
  while (!peer.connection.has_message()) {
    if (!peer.connection.fault().empty() || peer.connection.read() != Connection::Read::kBytes) {
      end(number, peer.connection.fault());
      return;
    }
  }
  settle(number, peer);
}

void Network::depart(Number number, Peer& peer, const std::string& reason) {
  if (!std::exchange(peer.has_departed, true)) {
    departures_.push_back({std::to_string(number), reason});
  }
}

void Network::end(Number number, const std::string& reason) {
  const auto found = peers_.find(number);
  depart(number, *found->second, reason);
  held_in_bytes_ -= found->second->held_in_bytes;
  waiting_out_bytes_ -= found->second->waiting_out_bytes;
  peers_.erase(found);
}

std::vector<Departure> Network::take_departures() {
  return std::exchange(departures_, {});
}

void Network::end_the_largest() {
  const auto end_largest = [&](std::size_t Peer::*bytes, const char* reason) {
    const auto largest =
        std::max_element(peers_.begin(), peers_.end(), [&](const auto& left, const auto& right) {
          return (*left.second).*bytes < (*right.second).*bytes;
        });
    end(largest->first, reason);
  };
  while (held_in_bytes_ > limits_.held_in_bytes) {
    end_largest(&Peer::held_in_bytes, "all connections together hold too much, and it holds most");
  }
  while (waiting_out_bytes_ > limits_.all_waiting_out_bytes) {
    end_largest(&Peer::waiting_out_bytes,
                "all connections together leave too much unread, and it leaves most");
  }
}

void Network::end_unfinished_handshakes(std::int64_t now_ms) {
  std::vector<Number> late;
  for (const auto& [number, peer] : peers_) {
    if (!peer->connection.is_open() && now_ms - peer->since_ms > limits_.handshake_ms) {
      late.push_back(number);
    }
  }
  for (const Number number : late) {
    end(number, "it does not finish its handshake");
  }
}

}  // namespace oblique::server
