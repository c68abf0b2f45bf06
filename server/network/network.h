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

/// Limits on memory and connections that peers can use. proto/protocol.md lists them.
struct NetworkLimits {
  std::size_t connections =
      limits::kConnections;  ///< maximum number at all ports; the system may allow fewer
  /// Maximum total size of messages that are incomplete or not taken. A peer has at most one
  /// message.
  std::size_t held_in_bytes = limits::kHeldInBytes;
  /// If the messages of a port exceed this size and one of them is complete, the server stops
  /// reading from the port's peers. So peers that send faster than results are stored must wait,
  /// but stay connected.
  std::size_t held_in_to_pause_bytes = limits::kHeldInToPauseBytes;
  /// A peer with more unsent output than this is busy.
  std::size_t busy_bytes = limits::kBusyBytes;
  std::size_t waiting_out_bytes = limits::kWaitingOutBytes;  ///< maximum unsent output of one peer
  /// the same limit for all peers together
  std::size_t all_waiting_out_bytes = limits::kAllWaitingOutBytes;
  std::int64_t handshake_ms = 10'000;  ///< maximum time of a handshake
  /// A connection that had input within this time is not ended to make room for a new one.
  std::int64_t active_ms = 5000;
  /// Maximum number of simultaneous handshakes. At this limit the oldest is ended after a tenth of
  /// `handshake_ms`.
  std::size_t handshakes = limits::kHandshakes;
  /// Maximum number of simultaneous handshakes from one source address, at a port with keys.
  std::size_t handshakes_of_source = limits::kHandshakesOfSource;
};

struct Incoming {
  std::string identity;  ///< identity of the connection; never reused
  std::string body;
  /// Name and role of the peer's key. Null at a port without keys.
  std::shared_ptr<const KeyIdentity> key = {};
};

struct Disconnect {
  std::string identity;
  std::string reason;  ///< why the server ended the connection; empty if the peer ended it
  /// has a value if the peer was not admitted, or if its key was revoked
  std::optional<RefusalCause> refused = {};
  std::string address = {};  ///< such as 10.0.0.3:4711; empty if `reason` is empty
};

/// The server's ports and connections, with limits on the memory that peers can fill. The server
/// stops reading from a peer that sends faster than it is served, so TCP slows the peer down. Peers
/// of a port take turns, message by message; each turn also runs a few handshake steps. The class
/// has no thread and blocks only in `flush`. All times are milliseconds of a monotonic clock.
class Network {
 public:
  explicit Network(NetworkLimits limits);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  using Port = std::size_t;
  /// Opens a port and returns its number, counted from 0. With `security` peers need keys
  /// (mechanism CURVE); without it all peers are admitted (mechanism NULL). Throws
  /// std::runtime_error if it cannot listen.
  Port listen(const std::string& address, const std::string& port,
              const std::optional<PortSecurity>& security = std::nullopt);
  const std::string& endpoint(Port port) const { return ports_.at(port).listener->endpoint(); }

  /// Becomes readable when `collect` has work.
  int descriptor() const { return epoll_.number(); }
  /// Accepts, reads, sends and ends connections as far as possible without blocking.
  void collect(std::int64_t now_ms);
  /// Returns whether `collect` has more work, although `descriptor` may not be readable.
  bool has_more() const;

  /// Returns whether the next message of this connection may be taken.
  using MayTake = std::function<bool(const std::string& identity)>;
  /// Takes the next message at a port, from the peer whose turn it is.
  std::optional<Incoming> next(Port port, const MayTake& may_take);

  /// Sends a message, and queues what the system does not accept. Disconnects a peer that leaves
  /// too much output unread.
  Delivery send(const std::string& identity, std::string_view body);
  /// Returns whether the peer's unsent output exceeds `busy_bytes`.
  bool is_busy(const std::string& identity) const;
  bool is_connected(const std::string& identity) const { return find(identity) != nullptr; }
  /// Returns whether the peer has a message that was not taken or is incomplete.
  bool has_unread_input(const std::string& identity) const;
  /// Sends unsent output, but stops after `longest`.
  void flush(std::chrono::milliseconds longest);

  /// Authenticates all connected peers again. Ends connections whose keys are not admitted any
  /// more, and drops their input.
  void admission_changed();

  /// Returns the connections that have ended since the last call.
  std::vector<Disconnect> take_disconnects() { return std::exchange(disconnects_, {}); }
  std::size_t connections() const { return peers_.size(); }
  std::size_t connections(Port port) const {
    return port < ports_.size() ? ports_[port].connections : 0;
  }
  /// Returns the size of messages that are incomplete or not taken [bytes].
  std::size_t held_in_bytes() const { return held_in_bytes_; }
  /// Returns the size of unsent output of all peers [bytes].
  std::size_t waiting_out_bytes() const { return waiting_out_bytes_; }
  /// Returns the number of refused peers since the start, by cause.
  const std::array<std::uint64_t, kRefusalCauses>& refusals() const { return refusals_; }

 private:
  using Number = std::uint64_t;
  struct OpenPort {
    std::unique_ptr<Listener> listener;
    std::unique_ptr<PortSecurity> security;
    std::size_t connections = 0;
    std::deque<Number> queue{};     // peers with a message, in order of their turns
    std::size_t held_in_bytes = 0;  // total size of the messages of this port's peers
    std::vector<Number> paused{};   // peers that are not read while the port is full
    bool is_accepting = true;       // if false, new connections wait in the kernel
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
  std::deque<Number> pending_steps_;  // peers with a handshake step to run, in turn
  std::set<Number> handshakes_;       // peers in a handshake, the oldest first
  std::map<std::string, std::set<Number>> handshakes_of_;
  std::size_t held_in_bytes_ = 0;
  std::int64_t now_ms_ = 0;  // time of the last `collect`
  std::size_t waiting_out_bytes_ = 0;
  std::vector<Disconnect> disconnects_;
  std::array<std::uint64_t, kRefusalCauses> refusals_{};
};

}  // namespace oblique::server
