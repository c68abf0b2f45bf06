#include "server/network/network.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <iterator>
#include <system_error>
#include <utility>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include "proto/socket/limits.h"
#include "server/network/zmtp.h"

namespace oblique::server {
namespace {

static_assert(CurveSession::kAddedBytes == protocol::kSealBytes);

/// Epoll reports a number for each event. Numbers below this one are ports; the others are peers.
constexpr std::uint64_t kFirstPeer = 16;
constexpr std::size_t kOtherDescriptors = 128;
constexpr std::size_t kFewestConnections = 16;
constexpr std::size_t kReadBytes = 64 * 1024;
constexpr std::size_t kReadInHandshake_bytes = 4 * 1024;

// Limits on handshakes with keys. A step of such a handshake costs as much as hundreds of messages.
constexpr std::size_t kStepsOfHandshake = 2;
constexpr std::size_t kStepsATurn = 16;
constexpr std::size_t kMaxPendingSteps = 64;
/// To make room for a new handshake, the oldest handshake may be ended at an age of handshake_ms /
/// kPartOfOldest, or a recent one from the same source at handshake_ms / kPartOfNewest. If
/// kPartOfOldest were 20, thousands of handshakes of a busy process would fail.
constexpr std::int64_t kPartOfOldest = 10;
constexpr std::int64_t kPartOfNewest = 100;

constexpr const char* kLeavesTooMuchUnread = "it does not read its output";

void set_option(int socket, int level, int option, int value) {
  // Fails only if the peer has disconnected. The next read reports that.
  static_cast<void>(setsockopt(socket, level, option, &value, sizeof value));
}

bool would_block() {
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

}  // namespace

// ---- One connection ---------------------------------------------------------------------------

class Network::Connection {
 public:
  Connection(protocol::Descriptor socket, const PortSecurity* security)
      : socket_(std::move(socket)), zmtp_(security) {
    constexpr protocol::KeepAlive kKeepAlive;
    const int fd = socket_.number();
    set_option(fd, IPPROTO_TCP, TCP_NODELAY, 1);
    set_option(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
    set_option(fd, IPPROTO_TCP, TCP_KEEPIDLE, kKeepAlive.idle_s);
    set_option(fd, IPPROTO_TCP, TCP_KEEPINTVL, kKeepAlive.interval_s);
    set_option(fd, IPPROTO_TCP, TCP_KEEPCNT, kKeepAlive.probes);
    set_option(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, kKeepAlive.unacknowledged_ms);
  }

  const Zmtp& zmtp() const { return zmtp_; }
  int descriptor() const { return socket_.number(); }
  std::size_t unsent_bytes() const { return out_.size() - sent_; }
  /// Returns whether output can be sent. If not, input may still be read.
  bool can_send() const { return can_send_; }
  bool has_pending_handshake() const {
    return zmtp_.pending_step() == Zmtp::PendingStep::kHandshake;
  }
  /// Returns whether the peer has sent a message, or an encrypted frame that may contain a message.
  bool has_input_to_take() const {
    return zmtp_.has_message() || zmtp_.pending_step() == Zmtp::PendingStep::kSealedFrame;
  }

  /// Reads once. Returns false if the connection has ended.
  bool read() {
    std::array<char, kReadBytes> bytes;
    const std::size_t most = zmtp_.is_open() ? bytes.size() : kReadInHandshake_bytes;
    const ssize_t count = ::recv(socket_.number(), bytes.data(), most, 0);
    if (count < 0 && would_block()) {
      return true;
    }
    if (count <= 0) {
      return false;
    }
    zmtp_.receive({bytes.data(), static_cast<std::size_t>(count)});
    send_answers();
    return true;
  }
  std::string take_message() {
    std::string message = zmtp_.take_message();
    send_answers();
    return message;
  }
  void run_step() {
    zmtp_.run_step();
    send_answers();
  }
  void send_answers() {
    const std::string answers = zmtp_.take_answers();
    if (can_send_ && !answers.empty()) {
      out_ += answers;
      flush();
    }
  }
  void send(std::string_view body);
  void flush();

 private:
  void stop_sending() {
    can_send_ = false;
    out_ = {};
    sent_ = 0;
  }

  protocol::Descriptor socket_;
  bool can_send_ = true;
  Zmtp zmtp_;
  std::string out_;
  std::size_t sent_ = 0;  // number of sent bytes at the beginning of `out_`
};

void Network::Connection::send(std::string_view body) {
  const bool is_waiting = unsent_bytes() > 0;
  out_ += zmtp_.begin_message(body);
  out_ += body;
  if (!is_waiting) {
    flush();
  }
}

void Network::Connection::flush() {
  while (unsent_bytes() > 0) {
    const ssize_t count =
        ::send(socket_.number(), out_.data() + sent_, unsent_bytes(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0 && !would_block()) {
      stop_sending();
      return;
    }
    if (count < 0) {
      break;
    }
    sent_ += static_cast<std::size_t>(count);
  }
  if (unsent_bytes() == 0) {
    out_ = {};
    sent_ = 0;
  } else if (sent_ > out_.size() / 2) {
    out_.erase(0, std::exchange(sent_, 0));
  }
}

struct Network::Peer {
  Peer(Listener::Accepted accepted, const PortSecurity* security, Port at, std::int64_t now_ms)
      : connection(std::move(accepted.socket), security),
        address(std::move(accepted.address)),
        port(at),
        since_ms(now_ms),
        last_input_ms(now_ms) {}

  bool wants_input() const {
    return !is_paused && !connection.has_input_to_take() && !connection.has_pending_handshake();
  }
  std::uint32_t wanted_events() const {
    return (wants_input() ? EPOLLIN : 0U) | (connection.unsent_bytes() > 0 ? EPOLLOUT : 0U);
  }

  Connection connection;
  PeerAddress address;
  Port port;
  std::int64_t since_ms;
  std::int64_t last_input_ms;
  bool is_queued = false;  // true if the peer is in its port's queue or in `pending_steps_`
  bool is_paused = false;
  bool is_in_handshake = true;
  std::uint32_t watched_events = 0;  // 0 if epoll does not watch the peer
  std::size_t held_in_bytes = 0;     // the peer's parts of the sums in Network
  std::size_t waiting_out_bytes = 0;
  std::shared_ptr<const KeyIdentity> key;
};

// ---- All connections --------------------------------------------------------------------------

Network::Network(NetworkLimits limits)
    : limits_(limits), epoll_(epoll_create1(EPOLL_CLOEXEC)), last_number_(kFirstPeer) {
  if (!epoll_.is_open()) {
    throw std::system_error(errno, std::generic_category(), "epoll_create1");
  }
  rlimit limit{};
  static_cast<void>(getrlimit(RLIMIT_NOFILE, &limit));
  limits_.connections = std::min<std::size_t>(
      limits_.connections,
      std::max<rlim_t>(limit.rlim_cur, kOtherDescriptors + kFewestConnections) - kOtherDescriptors);
}

Network::~Network() = default;

Network::Port Network::listen(const std::string& address, const std::string& port,
                              const std::optional<PortSecurity>& security) {
  const Port number = ports_.size();
  OpenPort opened{std::make_unique<Listener>(address, port),
                  security ? std::make_unique<PortSecurity>(*security) : nullptr};
  epoll_event event{EPOLLIN, {.u64 = number}};
  if (epoll_ctl(epoll_.number(), EPOLL_CTL_ADD, opened.listener->descriptor(), &event) != 0) {
    throw std::system_error(errno, std::generic_category(), "epoll_ctl");
  }
  ports_.push_back(std::move(opened));
  return number;
}

Network::Peer* Network::find(const std::string& identity) const {
  Number number = 0;
  std::from_chars(identity.data(), identity.data() + identity.size(), number);
  const auto found = peers_.find(number);
  return found == peers_.end() ? nullptr : found->second.get();
}

void Network::collect(std::int64_t now_ms) {
  now_ms_ = now_ms;
  read_paused_again();
  std::array<epoll_event, 256> events;
  const int count = epoll_wait(epoll_.number(), events.data(), static_cast<int>(events.size()), 0);
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    if (event.data.u64 < kFirstPeer) {
      accept_all(event.data.u64);
    } else {
      serve(event.data.u64, event.events);
    }
  }
  run_handshakes();
  for (Port port = 0; port < ports_.size(); ++port) {
    if (!ports_[port].is_accepting && !must_newcomers_wait()) {
      set_accepting(port, true);
    }
  }
  end_largest();
  while (!handshakes_.empty() &&
         now_ms - peers_.at(*handshakes_.begin())->since_ms > limits_.handshake_ms) {
    end(*handshakes_.begin(), "it does not finish its handshake", RefusalCause::kTooSlow);
  }
}

bool Network::has_more() const {
  return !pending_steps_.empty() ||
         std::any_of(ports_.begin(), ports_.end(), [this](const OpenPort& port) {
           return !port.paused.empty() && !is_full(port);
         });
}

// ---- New connections --------------------------------------------------------------------------

void Network::accept_all(Port port) {
  constexpr std::size_t kMaxAtATime = 64;
  // Accepts no more connections than can be handled in one turn. Further connections, for example
  // after a restart, wait in the kernel.
  const std::size_t most = ports_[port].security ? kStepsATurn / kStepsOfHandshake : kMaxAtATime;
  std::size_t taken = 0;
  for (std::size_t i = 0;
       i < kMaxAtATime && taken < most && pending_steps_.size() < kMaxPendingSteps; ++i) {
    if (must_newcomers_wait()) {
      set_accepting(port, false);
      return;
    }
    Listener::Accepted accepted = ports_[port].listener->accept();
    if (!accepted.socket.is_open()) {
      if (errno == EMFILE || errno == ENFILE) {
        make_room_for_connection(port);
      }
      return;
    }
    if (!make_room(port, accepted.address)) {
      count_refusal(RefusalCause::kBound);
      continue;
    }
    ++taken;
    ++ports_[port].connections;
    const Number number = ++last_number_;
    auto& peer = peers_[number];
    peer = std::make_unique<Peer>(std::move(accepted), ports_[port].security.get(), port, now_ms_);
    handshakes_.insert(number);
    handshakes_of_[peer->address.source].insert(number);
    peer->connection.send_answers();
    update(number, *peer);
  }
}

/// Returns true if the number of handshakes is at its limit and the oldest may not be ended yet. If
/// it were ended, its peer would reconnect at once, and among many slow peers none would ever be
/// admitted.
bool Network::must_newcomers_wait() const {
  return handshakes_.size() >= limits_.handshakes && !has_used(*handshakes_.begin(), kPartOfOldest);
}

bool Network::has_used(Number handshake, std::int64_t part) const {
  return now_ms_ - peers_.at(handshake)->since_ms >= limits_.handshake_ms / part;
}

void Network::set_accepting(Port port, bool is_accepting) {
  ports_[port].is_accepting = is_accepting;
  epoll_event event{is_accepting ? EPOLLIN : 0U, {.u64 = port}};
  epoll_ctl(epoll_.number(), EPOLL_CTL_MOD, ports_[port].listener->descriptor(), &event);
}

/// Ends a connection if a new one would exceed a limit. Returns false if the new one must be
/// refused.
bool Network::make_room(Port port, const PeerAddress& address) {
  if (ports_[port].security && !make_room_at_source(address)) {
    return false;
  }
  if (handshakes_.size() >= limits_.handshakes) {
    end_oldest_handshake();
  }
  return peers_.size() < limits_.connections || make_room_for_connection(port);
}

/// Applies the limit on handshakes from one source address. Ends the oldest handshake if it has had
/// its minimum time, else a recent one. So most handshakes of slow peers finish, and a fast peer is
/// soon admitted among many that never finish. Returns false if the new connection must be refused:
/// letting it wait would delay other sources.
bool Network::make_room_at_source(const PeerAddress& address) {
  constexpr std::size_t kPartForNewest = 8;
  const auto found = handshakes_of_.find(address.source);
  if (found == handshakes_of_.end() || found->second.size() < limits_.handshakes_of_source) {
    return true;
  }
  const std::set<Number>& handshakes = found->second;
  const auto newest = static_cast<std::ptrdiff_t>(handshakes.size() / kPartForNewest);
  const Number oldest = *handshakes.begin();
  const Number one_of_newest = *std::prev(handshakes.end(), newest + 1);
  const bool is_oldest_due = has_used(oldest, kPartOfOldest);
  if (!is_oldest_due && !has_used(one_of_newest, kPartOfNewest)) {
    return false;
  }
  end(is_oldest_due ? oldest : one_of_newest, "too many handshakes from its address",
      RefusalCause::kBound);
  return true;
}

/// Ends the oldest handshake. If there is none and the port has no keys, ends the connection that
/// was silent for longest. Returns false if no connection may be ended.
bool Network::make_room_for_connection(Port port) {
  if (end_oldest_handshake()) {
    return true;
  }
  if (ports_[port].security) {
    return false;
  }
  const auto quietest =
      std::min_element(peers_.begin(), peers_.end(), [](const auto& left, const auto& right) {
        return left.second->last_input_ms < right.second->last_input_ms;
      });
  if (quietest == peers_.end() || now_ms_ - quietest->second->last_input_ms < limits_.active_ms) {
    return false;
  }
  end(quietest->first, "too many connections, and it was silent for longest");
  return true;
}

// ---- Input ------------------------------------------------------------------------------------

void Network::serve(Number number, std::uint32_t events) {
  const auto found = peers_.find(number);
  if (found == peers_.end()) {
    return;
  }
  Peer& peer = *found->second;
  Connection& connection = peer.connection;
  const bool has_hung_up = (events & (EPOLLHUP | EPOLLERR)) != 0;
  if (has_hung_up || (events & EPOLLOUT) != 0) {
    connection.flush();
  }
  if (has_hung_up && connection.has_pending_handshake()) {
    end_peer_that_left(number, peer);
    return;
  }
  if (has_hung_up || (events & EPOLLIN) != 0) {
    if (peer.wants_input() && !has_hung_up && !peer.is_in_handshake && is_full(ports_[peer.port])) {
      peer.is_paused = true;
      ports_[peer.port].paused.push_back(number);
    }
    peer.last_input_ms = now_ms_;
    if (!peer.wants_input()) {
      watch(number, peer, peer.wanted_events());
    } else if (!connection.read()) {
      end_peer_that_left(number, peer);
      return;
    } else if (!examine(number, peer)) {
      return;
    }
  }
  update(number, peer);
  if (peer.waiting_out_bytes > limits_.waiting_out_bytes) {
    end(number, kLeavesTooMuchUnread);
  }
}

/// Runs at most kStepsATurn pending steps, so that connected peers are served in between.
void Network::run_handshakes() {
  for (std::size_t steps = 0; steps < kStepsATurn && !pending_steps_.empty();) {
    const Number number = pending_steps_.front();
    pending_steps_.pop_front();
    const auto found = peers_.find(number);
    if (found == peers_.end()) {
      continue;
    }
    ++steps;
    Peer& peer = *found->second;
    peer.is_queued = false;
    peer.connection.run_step();
    if (examine(number, peer)) {
      update(number, peer);
    }
  }
}

/// Handles a finished handshake. Ends a connection that has a fault, and then returns false.
bool Network::examine(Number number, Peer& peer) {
  const Zmtp& zmtp = peer.connection.zmtp();
  if (peer.is_in_handshake && zmtp.is_open()) {
    handshake_ended(number, peer);
    peer.key = zmtp.identity();
  }
  if (!zmtp.fault().empty()) {
    end(number, zmtp.fault(), peer.is_in_handshake ? std::optional(zmtp.cause()) : std::nullopt);
    return false;
  }
  return true;
}

void Network::handshake_ended(Number number, Peer& peer) {
  if (!std::exchange(peer.is_in_handshake, false)) {
    return;
  }
  handshakes_.erase(number);
  const auto of_source = handshakes_of_.find(peer.address.source);
  of_source->second.erase(number);
  if (of_source->second.empty()) {
    handshakes_of_.erase(of_source);
  }
}

/// Updates the sums, the peer's place in a queue and the awaited events. Must be called after any
/// change of a peer. While a message waits to be taken, the peer's input stays watched until more
/// arrives. Most messages are taken earlier, so that two system calls are saved.
void Network::update(Number number, Peer& peer) {
  const Connection& connection = peer.connection;
  update_sums(peer, connection.zmtp().held_bytes(), connection.unsent_bytes());
  if (!peer.is_queued && connection.has_input_to_take()) {
    ports_[peer.port].queue.push_back(number);
    peer.is_queued = true;
  } else if (!peer.is_queued && connection.has_pending_handshake()) {
    pending_steps_.push_back(number);
    peer.is_queued = true;
  }
  watch(number, peer, peer.wanted_events() | (peer.watched_events & EPOLLIN));
}

void Network::update_sums(Peer& peer, std::size_t held_in_bytes, std::size_t waiting_out_bytes) {
  held_in_bytes_ += held_in_bytes - peer.held_in_bytes;
  ports_[peer.port].held_in_bytes += held_in_bytes - peer.held_in_bytes;
  waiting_out_bytes_ += waiting_out_bytes - peer.waiting_out_bytes;
  peer.held_in_bytes = held_in_bytes;
  peer.waiting_out_bytes = waiting_out_bytes;
}

/// Sets the events to watch. A peer without awaited events is removed from the epoll set, which
/// would otherwise report a closed connection again and again.
void Network::watch(Number number, Peer& peer, std::uint32_t events) {
  if (events == peer.watched_events) {
    return;
  }
  const int operation = peer.watched_events == 0 ? EPOLL_CTL_ADD
                        : events == 0            ? EPOLL_CTL_DEL
                                                 : EPOLL_CTL_MOD;
  peer.watched_events = events;
  epoll_event event{events, {.u64 = number}};
  epoll_ctl(epoll_.number(), operation, peer.connection.descriptor(), &event);
}

void Network::read_paused_again() {
  for (OpenPort& port : ports_) {
    if (port.paused.empty() || is_full(port)) {
      continue;
    }
    for (const Number number : std::exchange(port.paused, {})) {
      if (const auto found = peers_.find(number); found != peers_.end()) {
        found->second->is_paused = false;
        update(number, *found->second);
      }
    }
  }
}

bool Network::has_unread_input(const std::string& identity) const {
  // On a slow line a trace may arrive for longer than a worker may be silent. So a message that is
  // still arriving counts as unread input.
  constexpr std::int64_t kPauseInMessage_ms = 1000;
  const Peer* const peer = find(identity);
  return peer != nullptr &&
         (peer->is_queued || peer->is_paused ||
          (peer->held_in_bytes > 0 && now_ms_ - peer->last_input_ms < kPauseInMessage_ms));
}

std::optional<Incoming> Network::next(Port port, const MayTake& may_take) {
  std::deque<Number>& queue = ports_[port].queue;
  std::size_t declined = 0;
  while (declined < queue.size()) {
    const Number number = queue.front();
    queue.pop_front();
    const auto found = peers_.find(number);
    if (found == peers_.end()) {
      continue;
    }
    Peer& peer = *found->second;
    std::string identity = std::to_string(number);
    if (!may_take(identity)) {
      queue.push_back(number);
      ++declined;
      continue;
    }
    peer.connection.run_step();
    std::optional<Incoming> incoming;
    if (peer.connection.zmtp().has_message()) {
      incoming = {std::move(identity), peer.connection.take_message(), peer.key};
    }
    peer.is_queued = false;
    if (examine(number, peer)) {
      update(number, peer);
    }
    if (incoming) {
      return incoming;
    }
  }
  return std::nullopt;
}

// ---- Output -----------------------------------------------------------------------------------

Delivery Network::send(const std::string& identity, std::string_view body) {
  Peer* const peer = find(identity);
  if (peer == nullptr || !peer->connection.can_send()) {
    return Delivery::kGone;
  }
  const Number number = std::stoull(identity);
  peer->connection.send(body);
  update(number, *peer);
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

void Network::flush(std::chrono::milliseconds longest) {
  using Clock = std::chrono::steady_clock;
  const auto until = Clock::now() + longest;
  while (Clock::now() < until) {
    std::vector<pollfd> waiting;
    for (const auto& [number, peer] : peers_) {
      peer->connection.flush();
      if (peer->connection.unsent_bytes() > 0) {
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

void Network::end(Number number, const std::string& reason, std::optional<RefusalCause> cause) {
  const auto found = peers_.find(number);
  Peer& peer = *found->second;
  if (cause) {
    count_refusal(*cause);
  }
  disconnects_.push_back(
      {std::to_string(number), reason, cause, reason.empty() ? "" : peer.address.text});
  update_sums(peer, 0, 0);
  --ports_[peer.port].connections;
  handshake_ended(number, peer);
  peers_.erase(found);
}

/// Ends a peer that has disconnected. A peer whose mechanism differs from that in the server's
/// greeting disconnects without a message, often in the middle of its own greeting.
void Network::end_peer_that_left(Number number, const Peer& peer) {
  if (peer.connection.zmtp().is_greeting()) {
    end(number,
        "it disconnected at the server's greeting: it may have no key while this server needs one, "
        "or "
        "have one while this server runs without keys",
        RefusalCause::kOtherMechanism);
  } else {
    end(number, "");
  }
}

/// Ends the connections with the most memory until the totals are within their limits.
void Network::end_largest() {
  const auto end_while = [this](const std::size_t& sum, std::size_t bound, std::size_t Peer::*bytes,
                                const char* reason) {
    while (sum > bound) {
      const auto largest =
          std::max_element(peers_.begin(), peers_.end(), [&](const auto& left, const auto& right) {
            return (*left.second).*bytes < (*right.second).*bytes;
          });
      end(largest->first, reason);
    }
  };
  end_while(held_in_bytes_, limits_.held_in_bytes, &Peer::held_in_bytes,
            "the input of all connections exceeds its limit, and it has the most");
  end_while(waiting_out_bytes_, limits_.all_waiting_out_bytes, &Peer::waiting_out_bytes,
            "the unsent output of all connections exceeds its limit, and it has the most");
}

bool Network::end_oldest_handshake() {
  if (handshakes_.empty()) {
    return false;
  }
  end(*handshakes_.begin(), "too many connections, and its handshake is the oldest",
      RefusalCause::kBound);
  return true;
}

void Network::admission_changed() {
  std::vector<std::pair<Number, Refusal>> refused;
  for (const auto& [number, peer] : peers_) {
    if (!peer->key) {
      continue;
    }
    AuthResult result = ports_[peer->port].security->authenticate(peer->connection.zmtp().key());
    if (auto* const refusal = std::get_if<Refusal>(&result)) {
      refused.emplace_back(number, std::move(*refusal));
    } else {
      peer->key = std::get<std::shared_ptr<const KeyIdentity>>(std::move(result));
    }
  }
  for (const auto& [number, refusal] : refused) {
    const bool was_removed = refusal.cause == RefusalCause::kUnknownKey;
    end(number, refusal.reason, was_removed ? RefusalCause::kRevokedKey : refusal.cause);
  }
}

}  // namespace oblique::server
