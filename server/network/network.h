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
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "server/network/connection.h"
#include "server/network/delivery.h"
#include "server/network/listener.h"

namespace oblique::server {

/// What peers can make the server hold; proto/protocol.md has these numbers.
struct NetworkLimits {
  std::size_t connections = 4096;  ///< at all ports; fewer where the system allows fewer
  /// Messages of all peers that are incomplete or not taken. Of one peer it is at most one message.
  std::size_t held_in_bytes = std::size_t{512} << 20U;
  /// With more than this waiting to go out, a peer is busy.
  std::size_t busy_bytes = std::size_t{4} << 20U;
  std::size_t waiting_out_bytes = std::size_t{64} << 20U;       ///< to one peer
  std::size_t all_waiting_out_bytes = std::size_t{512} << 20U;  ///< to all
  std::int64_t handshake_ms = 10'000;  ///< for a new connection to say who it is
  /// A connection that said something so recently does not make room for a new one.
  std::int64_t active_ms = 5000;
};

struct Incoming {
  std::string identity;  ///< of the connection; never given twice
  ZmtpMessage message;
};

struct Departure {
  std::string identity;
  std::string reason;  ///< empty: the peer has left; else why it was made to
};

/// The server's side of the network: ports, their connections, and a bound on all that any of them,
/// or all together, make it hold. A peer that sends faster than it is served is read no further, so
/// that TCP slows it down. Peers of a port take turns, message by message. Nothing here waits or
/// starts a thread. Times are milliseconds of any clock that never runs backwards.
class Network {
 public:
  explicit Network(NetworkLimits limits);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  using Port = std::size_t;
  /// Opens a port, the first one being number 0. Throws std::runtime_error when it cannot listen.
  Port listen(const std::string& address, const std::string& port);
  const std::string& endpoint(Port port) const { return listeners_.at(port)->endpoint(); }

  /// Readable when `collect` has something to do.
  int descriptor() const { return epoll_.number(); }
  /// Takes what the system has: new connections, bytes, room to send, ends.
  void collect(std::int64_t now_ms);

  /// Whether a peer's next message may be taken now; otherwise it waits, and the peer with it.
  using MayTake = std::function<bool(const std::string& identity)>;
  /// The next message at that port: of the peer whose turn it is.
  std::optional<Incoming> next(Port port, const MayTake& may_take);

  /// Never more than a peer's share is kept: one that leaves too much untaken is ended.
  Delivery send(const std::string& identity, std::string_view body);
  /// More waits to go out to it than a peer should have.
  bool is_busy(const std::string& identity) const;
  bool is_connected(const std::string& identity) const;
  /// Tries for so long to send what is kept.
  void flush(std::chrono::milliseconds longest);

  /// Who has gone since the last call.
  std::vector<Departure> take_departures();
  std::size_t connections() const { return peers_.size(); }
  /// Memory for messages that have not come whole, or were not taken.
  std::size_t held_in_bytes() const { return held_in_bytes_; }
  /// Bytes that the system has not taken yet.
  std::size_t waiting_out_bytes() const { return waiting_out_bytes_; }

 private:
  using Number = std::uint64_t;
  struct Peer {
    explicit Peer(protocol::Descriptor socket) : connection(std::move(socket)) {}
    Connection connection;
    Port port = 0;
    std::int64_t since_ms = 0;
    std::int64_t last_heard_ms = 0;
    bool stands_in_line = false;
    bool is_ending = false;  // nothing new is awaited of it; what has come is read to its end
    bool has_departed = false;
    std::uint32_t watched_events = 0;
    std::size_t held_in_bytes = 0;  // as counted in the sums
    std::size_t waiting_out_bytes = 0;
  };
  using Peers = std::unordered_map<Number, std::unique_ptr<Peer>>;

  void accept_all(Port port, std::int64_t now_ms);
  bool make_room(std::int64_t now_ms);
  void serve(Number number, std::uint32_t events, std::int64_t now_ms);
  void read_to_the_end(Number number, Peer& peer);
  void depart(Number number, Peer& peer, const std::string& reason);
  void end(Number number, const std::string& reason);
  void settle(Number number, Peer& peer);
  void watch(Number number, Peer& peer, int operation);
  void end_the_largest();
  void end_unfinished_handshakes(std::int64_t now_ms);
  Peer* find(const std::string& identity) const;

  NetworkLimits limits_;
  protocol::Descriptor epoll_;
  std::vector<std::unique_ptr<Listener>> listeners_;
  std::vector<std::deque<Number>> lines_;  // by port: peers with a message, in turn
  Peers peers_;
  Number last_number_;
  std::size_t held_in_bytes_ = 0;
  std::size_t waiting_out_bytes_ = 0;
  std::int64_t next_look_ms_ = 0;
  std::vector<Departure> departures_;
};

}  // namespace oblique::server
