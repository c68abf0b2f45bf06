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
/// Of handshakes with keys.
constexpr std::size_t kStepsOfHandshake = 2;
constexpr std::size_t kStepsATurn = 16;
constexpr std::size_t kMostWaitingSteps = 64;
constexpr const char* kLeavesTooMuchUnread = "it leaves too much unread";
constexpr const char* kNoRoom = "there are too many connections, and none that would make room";

bool has_something_to_take(const Zmtp& said) {
  return said.has_message() || said.waiting_work() == Zmtp::Work::kSealedFrame;
}

bool is_waiting(const Zmtp& said) {
  return said.has_message() || said.waiting_work() != Zmtp::Work::kNone;
}

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
  // One key never has so many that others find no room.
  constexpr std::size_t kPartForOthers = 8;
  limits_.connections_of_key = std::min(limits_.connections_of_key,
                                        limits_.connections - limits_.connections / kPartForOthers);
}

Network::~Network() = default;

Network::Port Network::listen(const std::string& address, const std::string& port,
                              const std::optional<PortGuard>& guard) {
  const Port number = ports_.size();
  OpenPort opened{std::make_unique<Listener>(address, port), nullptr, nullptr, {}};
  if (guard) {
    opened.doorkeeper = guard->doorkeeper;
    opened.guard = std::make_unique<PortGuard>(*guard);
    opened.guard->doorkeeper =
        std::make_shared<BoundedDoorkeeper>(guard->doorkeeper, shares_, limits_.connections_of_key);
  }
  epoll_event event{EPOLLIN, {.u64 = number}};
  if (epoll_ctl(epoll_.number(), EPOLL_CTL_ADD, opened.listener->descriptor(), &event) != 0) {
    throw std::system_error(errno, std::generic_category(), "epoll_ctl");
  }
  ports_.push_back(std::move(opened));
  return number;
}

// ---- What comes -------------------------------------------------------------------------------

std::size_t Network::connections(Port port) const {
  return static_cast<std::size_t>(
      std::count_if(peers_.begin(), peers_.end(),
                    [port](const auto& peer) { return peer.second->port == port; }));
}

void Network::collect(std::int64_t now_ms) {
  now_ms_ = now_ms;
  has_unopened_ = false;
  read_paused_again();
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
  shake_hands();
  accept_again(now_ms);
  end_the_largest();
  if (now_ms >= next_look_ms_) {
    next_look_ms_ = now_ms + kLookInterval_ms;
    end_unfinished_handshakes(now_ms);
  }
}

void Network::accept_all(Port port, std::int64_t now_ms) {
  constexpr std::size_t kMostAtATime = 64;
  // No more than can be let in: a crowd waits in the system, where nobody is turned away.
  const bool has_keys = ports_[port].guard != nullptr;
  const std::size_t most = has_keys ? kStepsATurn / kStepsOfHandshake : kMostAtATime;
  std::size_t taken = 0;
  for (std::size_t i = 0;
       i < kMostAtATime && taken < most && handshakes_.size() < kMostWaitingSteps; ++i) {
    if (must_newcomers_wait(now_ms)) {
      let_newcomers_wait(port);
      return;
    }
    Listener::Accepted accepted = ports_[port].listener->accept();
    if (!accepted.socket.is_open()) {
      if (errno == EMFILE || errno == ENFILE) {
        make_room(port, now_ms);
      }
      return;
    }
    if (has_keys && !has_room_for(accepted.address, now_ms)) {
      continue;
    }
    ++taken;
    if (strangers_.size() >= limits_.handshakes) {
      end_oldest_handshake();
    }
    if (peers_.size() < limits_.connections || make_room(port, now_ms)) {
      accept(port, std::move(accepted), now_ms);
    } else {
      count_refusal(RefusalCause::kBound, accepted.address.text(), kNoRoom);
    }
  }
}

void Network::accept(Port port, Listener::Accepted accepted, std::int64_t now_ms) {
  const Number number = ++last_number_;
  auto peer = std::make_unique<Peer>(std::move(accepted), ports_[port].guard.get());
  peer->port = port;
  peer->since_ms = peer->last_heard_ms = now_ms;
  Peer& stored = *peers_.emplace(number, std::move(peer)).first->second;
  strangers_.insert(number);
  strangers_of_[stored.address.source()].insert(number);
  watch(number, stored, EPOLL_CTL_ADD);
  stored.connection.greet();
  settle(number, stored);
}

/// For one more at that port. Ends the oldest of those who have not said who they are; where there
/// are no keys, else the connection that has said nothing for longest. Nobody who has shown a key
/// makes room for a stranger. False when there is none.
bool Network::make_room(Port port, std::int64_t now_ms) {
  if (end_oldest_handshake()) {
    return true;
  }
  if (ports_[port].guard) {
    return false;
  }
  const auto quietest =
      std::min_element(peers_.begin(), peers_.end(), [](const auto& left, const auto& right) {
        return left.second->last_heard_ms < right.second->last_heard_ms;
      });
  if (quietest == peers_.end() || now_ms - quietest->second->last_heard_ms < limits_.active_ms) {
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
  if (has_something_to_take(connection.said())) {
    if (has_ended) {
      peer.is_ending = true;
      epoll_ctl(epoll_.number(), EPOLL_CTL_DEL, connection.descriptor(), nullptr);
    }
  } else if (!has_ended && (events & EPOLLIN) != 0 && !peer.is_stranger &&
             is_full(ports_[peer.port])) {
    peer.last_heard_ms = now_ms;
    peer.is_paused = true;
    ports_[peer.port].paused.push_back(number);
  } else if (has_ended || (events & EPOLLIN) != 0) {
    peer.last_heard_ms = now_ms;
    const bool shakes_hands = connection.said().waiting_work() == Zmtp::Work::kHandshake;
    if (shakes_hands || connection.read() == Connection::Read::kEnd) {
      end_who_has_left(number, peer);
      return;
    }
    if (!connection.said().fault().empty()) {
      end_faulty(number, peer);
      return;
    }
    if (peer.is_stranger && connection.said().is_open()) {
      let_in(number, peer);
    }
  }
  settle(number, peer);
  if (peer.waiting_out_bytes > limits_.waiting_out_bytes) {
    end(number, kLeavesTooMuchUnread);
  }
}

/// A few of the steps that wait: each costs as much as hundreds of messages of those who are in.
void Network::shake_hands() {
  for (std::size_t steps = 0; steps < kStepsATurn && !handshakes_.empty();) {
    const Number number = handshakes_.front();
    handshakes_.pop_front();
    const auto found = peers_.find(number);
    if (found == peers_.end()) {
      continue;
    }
    ++steps;
    Peer& peer = *found->second;
    peer.stands_in_line = false;
    peer.connection.do_work();
    if (!peer.connection.said().fault().empty()) {
      end_faulty(number, peer);
      continue;
    }
    if (peer.connection.said().is_open()) {
      let_in(number, peer);
    }
    settle(number, peer);
  }
}

void Network::let_in(Number number, Peer& peer) {
  handshake_is_over(number, peer);
  peer.holder = peer.connection.said().holder();
  if (peer.holder) {
    peer.share = &shares_.join(peer.connection.said().key(), peer.holder);
    peer.share->held_in_bytes += peer.held_in_bytes;
    peer.share->waiting_out_bytes += peer.waiting_out_bytes;
  }
}

/// What it holds, in the sums.
void Network::count(Peer& peer, std::size_t held_in_bytes, std::size_t waiting_out_bytes) {
  held_in_bytes_ += held_in_bytes - peer.held_in_bytes;
  ports_[peer.port].held_in_bytes += held_in_bytes - peer.held_in_bytes;
  waiting_out_bytes_ += waiting_out_bytes - peer.waiting_out_bytes;
  if (peer.share != nullptr) {
    peer.share->held_in_bytes += held_in_bytes - peer.held_in_bytes;
    peer.share->waiting_out_bytes += waiting_out_bytes - peer.waiting_out_bytes;
    a_key_has_too_much_ = a_key_has_too_much_ ||
                          peer.share->held_in_bytes > limits_.held_in_bytes_of_key ||
                          peer.share->waiting_out_bytes > limits_.waiting_out_bytes_of_key;
  }
  peer.held_in_bytes = held_in_bytes;
  peer.waiting_out_bytes = waiting_out_bytes;
}

/// After anything happened to a peer: its sums, its place in the line, what is awaited of it.
void Network::settle(Number number, Peer& peer) {
  Connection& connection = peer.connection;
  const Zmtp& said = connection.said();
  count(peer, connection.held_in_bytes(), connection.waiting_out_bytes());
  if (!peer.stands_in_line && is_waiting(said)) {
    peer.stands_in_line = true;
    (has_something_to_take(said) ? ports_[peer.port].line : handshakes_).push_back(number);
  }
  if (!connection.can_send()) {
    depart(number, peer, "", std::nullopt);
  }
  if (!peer.is_ending) {
    watch(number, peer, EPOLL_CTL_MOD);
  }
}

/// A peer whose turn has not come yet is read no further.
void Network::watch(Number number, Peer& peer, int operation) {
  const Connection& connection = peer.connection;
  const std::uint32_t events = (is_waiting(connection.said()) || peer.is_paused ? 0U : EPOLLIN) |
                               (connection.waiting_out_bytes() > 0 ? EPOLLOUT : 0U);
  if (operation == EPOLL_CTL_MOD && events == peer.watched_events) {
    return;
  }
  peer.watched_events = events;
  epoll_event event{events, {.u64 = number}};
  epoll_ctl(epoll_.number(), operation, connection.descriptor(), &event);
}

std::optional<Incoming> Network::next(Port port, const MayTake& may_take) {
  // Of sealed frames that turn out to be no messages.
  constexpr std::size_t kMostOpened = 64;
  std::deque<Number>& line = ports_[port].line;
  std::size_t declined = 0;
  std::size_t opened = 0;
  while (declined < line.size() && opened < kMostOpened) {
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
      ++declined;
      continue;
    }
    peer.connection.do_work();
    std::optional<Incoming> incoming;
    if (peer.connection.said().has_message()) {
      incoming = {std::move(identity), peer.connection.take_message(), peer.holder};
    } else {
      ++opened;
    }
    peer.stands_in_line = false;
    if (peer.is_ending) {
      read_to_the_end(number, peer);
    } else if (!is_waiting(peer.connection.said()) && !peer.connection.said().fault().empty()) {
      end_faulty(number, peer);
    } else {
      settle(number, peer);
    }
    if (incoming) {
      return incoming;
    }
  }
  has_unopened_ = has_unopened_ || (opened > 0 && !line.empty());
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

}  // namespace oblique::server
