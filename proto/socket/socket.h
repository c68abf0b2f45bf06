#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <zmq.hpp>

#include "proto/keys/key_file.h"

namespace oblique::protocol {

/// Settings of a socket, different for workers and clients.
struct DealerSettings {
  std::string url;             ///< such as tcp://127.0.0.1:7600
  std::string example_url;     ///< an example of an address, for messages
  int linger_ms = 0;           ///< time to send the remaining messages after closing
  int shortest_pause_ms = 20;  ///< between attempts to connect
  int longest_pause_ms = 1000;
  bool queues_unconnected = true;  ///< accepts messages while it is not connected
  bool is_worker = false;          ///< it connects to the workers' port, else to the clients'
  /// The socket's key and the server's public key. With a key the connection is encrypted and only
  /// that server is accepted. Without one it is plain text.
  std::optional<KeyFile> key = {};
};

/// Makes a DEALER socket with the options that all our sockets share (limits.h, the largest frame).
/// It does not connect yet. Throws solver::InputError for an invalid `url` and for a server's key.
zmq::socket_t make_dealer(zmq::context_t& context, const DealerSettings& settings);

/// Starts to connect in the background, and again whenever a connection ends; a host name is
/// resolved each time. A name may have IPv4 and IPv6 addresses, and the server may listen on one of
/// them only: each `attempt` tries the other kind, IPv4 first. Throws solver::InputError as
/// `make_dealer` does.
void connect(zmq::socket_t& socket, const DealerSettings& settings, unsigned attempt = 0);

/// Watches the connections of a socket with one peer: how often it was connected, and whether the
/// peer rejected it. Messages that a socket has passed to a connection are lost with it.
class SocketMonitor {
 public:
  /// `socket` was made with `settings` and must not be connected yet. It and `context` must outlive
  /// this.
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, DealerSettings settings);
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  /// A ZeroMQ socket that is readable when the state may have changed.
  void* handle() { return events_.handle(); }

  /// Number of connections so far, including the current one, that have completed their handshake.
  std::uint64_t connections();
  /// Why the peer rejected the socket, and the remedy, without a full stop. A rejected socket does
  /// not connect again; make a new one.
  std::optional<std::string> rejection();

 private:
  /// The event that ended a handshake, and its value.
  struct Failure {
    std::uint16_t event;
    std::uint32_t value;
  };
  void take_events();

  zmq::socket_t& socket_;
  DealerSettings settings_;
  zmq::socket_t events_;
  std::uint64_t connections_ = 0;
  std::optional<Failure> failure_;
};

}  // namespace oblique::protocol
