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
#include <vector>

#include "server/network/connection.h"
#include "server/network/delivery.h"
#include "server/network/key_shares.h"
#include "server/network/listener.h"
#include "server/study/limits.h"

namespace oblique::server {

/// What peers can make the server hold. The first and `waiting_out_bytes` are options.
struct NetworkLimits {
  std::size_t connections =
      limits::kConnections;  ///< at all ports; fewer where the system allows fewer
  /// Messages of all peers that are incomplete or not taken. Of one peer it is at most one message.
  std::size_t held_in_bytes = std::size_t{512} << 20U;
  /// With so much of a port's peers, nobody of them is read while whole messages wait to be taken:
  /// who delivers more than is stored waits, and loses no connection.
  std::size_t held_in_to_pause_bytes = std::size_t{64} << 20U;
  /// With more than this waiting to go out, a peer is busy.
  std::size_t busy_bytes = std::size_t{4} << 20U;
  std::size_t waiting_out_bytes = limits::kWaitingOutBytes;     ///< to one peer
  std::size_t all_waiting_out_bytes = std::size_t{512} << 20U;  ///< to all
  std::int64_t handshake_ms = 10'000;  ///< for a new connection to say who it is
  /// A connection that said something so recently does not make room for a new one.
  std::int64_t active_ms = 5000;
  /// Under way at a time. The oldest of more is ended once it has had a tenth of `handshake_ms`.
  std::size_t handshakes = 1024;
  /// Of these, with one source address at a port with keys. No option of the server.
  std::size_t handshakes_of_source = 512;
  /// What the connections of one key may have together. One key can be all workers'.
  std::size_t connections_of_key = 3072;  ///< at most 7/8 of all
  std::size_t held_in_bytes_of_key = std::size_t{256} << 20U;
  std::size_t waiting_out_bytes_of_key = std::size_t{256} << 20U;
};

struct Incoming {
  std::string identity;  ///< of the connection; never given twice
  ZmtpMessage message;
  /// Whose key the peer has shown; null at a port without a guard.
  std::shared_ptr<const KeyHolder> holder = {};
};

struct Departure {
  std::string identity;
  std::string reason;                        ///< empty: the peer has left; else why it was made to
  std::optional<RefusalCause> refused = {};  ///< it was not let in, or its key is admitted no more
  std::string address = {};                  ///< as 10.0.0.3:4711; where there is a reason
};

/// Peers that were not let in, or were sent away because of their key, for one cause.
struct RefusalCount {
  std::uint64_t count = 0;
  std::string last_address;
  std::string last_reason;
};
/// By cause.
using RefusalCounts = std::array<RefusalCount, kRefusalCauses>;

/// The server's side of the network: ports, their connections, and a bound on all that any of them,
/// or all together, make it hold. A peer that sends faster than it is served is read no further, so
/// that TCP slows it down. Peers of a port take turns, message by message, and handshakes with keys
/// a few at a time. Nothing here waits or starts a thread. Times are milliseconds of any clock that
/// never runs backwards.
class Network {
 public:
  explicit Network(NetworkLimits limits);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  using Port = std::size_t;
  /// Opens a port, the first one being number 0. With a guard, peers get in by their keys (CURVE);
  /// without one, all do (NULL). Throws std::runtime_error when it cannot listen.
  Port listen(const std::string& address, const std::string& port,
              const std::optional<PortGuard>& guard = std::nullopt);
  const std::string& endpoint(Port port) const { return ports_.at(port).listener->endpoint(); }

  /// Readable when `collect` has something to do.
  int descriptor() const { return epoll_.number(); }
  /// Takes what the system has: new connections, bytes, room to send, ends.
  void collect(std::int64_t now_ms);
  /// `collect` or `next` would do more at once, though `descriptor` may not say so.
  bool has_more() const;

  /// Whether a peer's next message may be taken now; otherwise it waits, and the peer with it.
  using MayTake = std::function<bool(const std::string& identity)>;
  /// The next message at that port: of the peer whose turn it is.
  std::optional<Incoming> next(Port port, const MayTake& may_take);

  /// Never more than a peer's share is kept: one that leaves too much untaken is ended.
  Delivery send(const std::string& identity, std::string_view body);
  /// More waits to go out to it than a peer should have.
  bool is_busy(const std::string& identity) const;
  bool is_connected(const std::string& identity) const;
  /// Something has come from it that was not taken yet, or a message is coming in.
  bool has_unheard(const std::string& identity) const;
  /// Tries for so long to send what is kept.
  void flush(std::chrono::milliseconds longest);

  /// Asks the doorkeepers again about everybody who is in, and ends at once, with all that they had
  /// sent, the connections of those who are admitted no more.
  void admission_changed();

  /// Who has gone since the last call.
  std::vector<Departure> take_departures();
  std::size_t connections() const { return peers_.size(); }
  std::size_t connections(Port port) const;
  /// Memory for messages that have not come whole, or were not taken.
  std::size_t held_in_bytes() const { return held_in_bytes_; }
  /// Bytes that the system has not taken yet.
  std::size_t waiting_out_bytes() const { return waiting_out_bytes_; }
  /// Since the beginning.
  const RefusalCounts& refusals() const { return refusals_; }
  /// What each key that is connected has.
  const KeyShares& key_shares() const { return shares_; }

 private:
  using Number = std::uint64_t;
  struct OpenPort {
    std::unique_ptr<Listener> listener;
    std::shared_ptr<const Doorkeeper> doorkeeper;  // as it was given
    std::unique_ptr<PortGuard> guard;              // bounded too
    std::deque<Number> line;                       // peers with a message, in turn
    std::size_t held_in_bytes = 0;                 // of its peers
    std::vector<Number> paused{};                  // peers that are not read meanwhile
    bool is_closed = false;                        // newcomers wait in the system
  };
  struct Peer {
    Peer(Listener::Accepted accepted, const PortGuard* guard)
        : connection(std::move(accepted.socket), guard), address(accepted.address) {}
    Connection connection;
    PeerAddress address;
    Port port = 0;
    std::int64_t since_ms = 0;
    std::int64_t last_heard_ms = 0;
    bool stands_in_line = false;
    bool is_paused = false;
    bool is_stranger = true;  // its handshake is not done
    bool is_ending = false;   // nothing new is awaited of it; what has come is read to its end
    bool has_departed = false;
    std::uint32_t watched_events = 0;
    std::size_t held_in_bytes = 0;  // as counted in the sums
    std::size_t waiting_out_bytes = 0;
    std::shared_ptr<const KeyHolder> holder;
    KeyShare* share = nullptr;
  };
  using Peers = std::unordered_map<Number, std::unique_ptr<Peer>>;

  void accept_all(Port port, std::int64_t now_ms);
  void accept(Port port, Listener::Accepted accepted, std::int64_t now_ms);
  bool make_room(Port port, std::int64_t now_ms);
  void serve(Number number, std::uint32_t events, std::int64_t now_ms);
  void shake_hands();
  void let_in(Number number, Peer& peer);
  void handshake_is_over(Number number, Peer& peer);
  void end_who_has_left(Number number, const Peer& peer);
  void read_to_the_end(Number number, Peer& peer);
  void depart(Number number, Peer& peer, const std::string& reason,
              std::optional<RefusalCause> refused);
  void end(Number number, const std::string& reason,
           std::optional<RefusalCause> cause = std::nullopt);
  void end_faulty(Number number, const Peer& peer);
  void settle(Number number, Peer& peer);
  void count(Peer& peer, std::size_t held_in_bytes, std::size_t waiting_out_bytes);
  void watch(Number number, Peer& peer, int operation);
  bool is_full(const OpenPort& port) const {
    return !port.line.empty() && port.held_in_bytes >= limits_.held_in_to_pause_bytes;
  }
  void read_paused_again();
  bool must_newcomers_wait(std::int64_t now_ms) const;
  bool has_had(Number stranger, std::int64_t part, std::int64_t now_ms) const;
  bool has_room_for(const PeerAddress& address, std::int64_t now_ms);
  void let_newcomers_wait(Port port);
  void accept_again(std::int64_t now_ms);
  void end_the_largest();
  void end_the_largest_of_keys();
  bool end_oldest_handshake();
  void count_refusal(RefusalCause cause, const std::string& address, const std::string& reason);
  void end_unfinished_handshakes(std::int64_t now_ms);
  Peer* find(const std::string& identity) const;

  NetworkLimits limits_;
  protocol::Descriptor epoll_;
  KeyShares shares_;
  std::vector<OpenPort> ports_;
  Peers peers_;
  Number last_number_;
  std::deque<Number> handshakes_;  // whose next step waits, in turn
  std::set<Number> strangers_;     // whose handshakes are under way, the oldest first
  std::map<PeerAddress::Source, std::set<Number>> strangers_of_;
  bool has_unopened_ = false;
  bool a_key_has_too_much_ = false;
  std::size_t held_in_bytes_ = 0;
  std::size_t waiting_out_bytes_ = 0;
  std::int64_t next_look_ms_ = 0;
  std::int64_t now_ms_ = 0;  // of the last `collect`
  std::vector<Departure> departures_;
  RefusalCounts refusals_;
};

}  // namespace oblique::server
