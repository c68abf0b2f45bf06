#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/network/authenticator.h"
#include "server/network/listener.h"
#include "server/study/limits.h"

namespace oblique::server {

/// Bounds on what peers can make the server hold; proto/protocol.md lists them.
struct NetworkLimits {
  std::size_t connections =
      limits::kConnections;  ///< at all ports; fewer if the system allows fewer
  /// Messages of all peers that are incomplete or were not taken. One peer has at most one message.
  std::size_t held_in_bytes = limits::kHeldInBytes;
  /// While a port's messages take this much and one of them waits to be taken, its peers are not
  /// read: peers that send faster than results are stored wait, and lose no connection.
  std::size_t held_in_to_pause_bytes = limits::kHeldInToPauseBytes;
  /// A peer with more unsent output than this is busy.
  std::size_t busy_bytes = limits::kBusyBytes;
  std::size_t waiting_out_bytes = limits::kWaitingOutBytes;         ///< unsent output of one peer
  std::size_t all_waiting_out_bytes = limits::kAllWaitingOutBytes;  ///< of all peers
  std::int64_t handshake_ms = 10'000;                               ///< for one handshake
  /// A connection with input this recent is not ended to make room for a new one.
  std::int64_t active_ms = 5000;
  /// Handshakes at a time. At the limit the oldest is ended once it has had a tenth of
  /// `handshake_ms`.
  std::size_t handshakes = limits::kHandshakes;
  /// Of these, from one source address at a port with keys.
  std::size_t handshakes_of_source = limits::kHandshakesOfSource;
};

struct Incoming {
  std::string identity;  ///< of the connection; never reused
  std::string body;
  /// With which name and role the peer's key is listed. Null at a port without keys.
  std::shared_ptr<const KeyIdentity> key = {};
};

struct Disconnect {
  std::string identity;
  std::string reason;                        ///< why the server ended it; empty: the peer left
  std::optional<RefusalCause> refused = {};  ///< not admitted, or its key no longer is
  std::string address = {};                  ///< as 10.0.0.3:4711; empty without a reason
};

/// The server's ports and their connections, with bounds on all that peers can make it hold. A peer
/// that sends faster than it is served is not read, so that TCP slows it down. Peers of a port take
/// turns, message by message; a few handshakes with keys are run in each turn. It has no thread and
/// never waits, except in `flush`. Times are milliseconds of a monotonic clock.
class Network {
 public:
  explicit Network(NetworkLimits limits);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  using Port = std::size_t;
  /// Opens a port and returns its number, from 0 up. With `security` peers need keys (CURVE);
  /// without it all are admitted (NULL). Throws std::runtime_error if it cannot listen.
  Port listen(const std::string& address, const std::string& port,
              const std::optional<PortSecurity>& security = std::nullopt);
  const std::string& endpoint(Port port) const { return ports_.at(port).listener->endpoint(); }

  /// Readable when `collect` has work.
  int descriptor() const { return epoll_.number(); }
  /// Accepts connections, reads, sends and ends connections, as far as possible without waiting.
  void collect(std::int64_t now_ms);
  /// `collect` has more work, though `descriptor` may not be readable.
  bool has_more() const;

  /// Whether the next message of that connection may be taken now.
  using MayTake = std::function<bool(const std::string& identity)>;
  /// The next message at that port, of the peer whose turn it is.
  std::optional<Incoming> next(Port port, const MayTake& may_take);

  /// Sends a message, or keeps what the system does not take. A peer that leaves too much unread is
  /// disconnected.
  Delivery send(const std::string& identity, std::string_view body);
  /// Its unsent output exceeds `busy_bytes`.
  bool is_busy(const std::string& identity) const;
  bool is_connected(const std::string& identity) const { return find(identity) != nullptr; }
  /// It has sent something that was not taken, or a message is coming in.
  bool has_unread_input(const std::string& identity) const;
  /// Sends unsent output, for at most this long.
  void flush(std::chrono::milliseconds longest);

  /// Authenticates all connected peers again, and ends the connections whose keys are no longer
  /// admitted; what they have sent is dropped.
  void admission_changed();

  /// Connections that ended since the last call.
  std::vector<Disconnect> take_disconnects() { return std::exchange(disconnects_, {}); }
  std::size_t connections() const { return peers_.size(); }
  std::size_t connections(Port port) const {
    return port < ports_.size() ? ports_[port].connections : 0;
  }
  /// Memory for messages that are incomplete or were not taken.
  std::size_t held_in_bytes() const { return held_in_bytes_; }
  /// Unsent output of all peers.
  std::size_t waiting_out_bytes() const { return waiting_out_bytes_; }
  /// Peers that were refused since the start, by cause.
  const std::array<std::uint64_t, kRefusalCauses>& refusals() const { return refusals_; }

 private:
  using Number = std::uint64_t;
  struct OpenPort {
    std::unique_ptr<Listener> listener;
    std::unique_ptr<PortSecurity> security;
    std::size_t connections = 0;
    std::deque<Number> queue{};     // peers with a message, in turn
    std::size_t held_in_bytes = 0;  // of its peers
    std::vector<Number> paused{};   // peers that are not read while the port is full
    bool is_accepting = true;       // else new connections wait in the system
  };
  class Connection;
  struct Peer;

  void accept_all(Port port);
  bool must_newcomers_wait() const;
  void set_accepting(Port port, bool is_accepting);
  bool make_room(Port port, const PeerAddress& address);
  bool make_room_at_source(const PeerAddress& address);
  bool make_room_for_connection(Port port);
  bool end_oldest_handshake();
  bool has_used(Number handshake, std::int64_t part) const;

  void serve(Number number, std::uint32_t events);
  void run_handshakes();
  bool examine(Number number, Peer& peer);
  void handshake_ended(Number number, Peer& peer);
  void update(Number number, Peer& peer);
  void update_sums(Peer& peer, std::size_t held_in_bytes, std::size_t waiting_out_bytes);
  void watch(Number number, Peer& peer, std::uint32_t events);
  bool is_full(const OpenPort& port) const {
    return !port.queue.empty() && port.held_in_bytes >= limits_.held_in_to_pause_bytes;
  }
  void read_paused_again();

  void end(Number number, const std::string& reason,
           std::optional<RefusalCause> cause = std::nullopt);
  void end_peer_that_left(Number number, const Peer& peer);
  void end_largest();
  void count_refusal(RefusalCause cause) { ++refusals_.at(static_cast<std::size_t>(cause)); }
  Peer* find(const std::string& identity) const;

  NetworkLimits limits_;
  protocol::Descriptor epoll_;
  std::vector<OpenPort> ports_;
  std::unordered_map<Number, std::unique_ptr<Peer>> peers_;
  Number last_number_;
  std::deque<Number> pending_steps_;  // peers with a step of a handshake to run, in turn
  std::set<Number> handshakes_;       // peers whose handshake is not done, the oldest first
  std::map<std::string, std::set<Number>> handshakes_of_;
  std::size_t held_in_bytes_ = 0;
  std::int64_t now_ms_ = 0;  // of the last `collect`
  std::size_t waiting_out_bytes_ = 0;
  std::vector<Disconnect> disconnects_;
  std::array<std::uint64_t, kRefusalCauses> refusals_{};
};

}  // namespace oblique::server
