#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <zmq.hpp>

#include "proto/keys/key_file.h"

namespace oblique::protocol {

/// Settings of a socket. They differ between workers and clients.
struct DealerSettings {
  std::string url;             ///< such as tcp://127.0.0.1:7600
  std::string example_url;     ///< an example of an address, shown in messages
  int linger_ms = 0;           ///< time for sending the remaining messages after closing
  int shortest_pause_ms = 20;  ///< shortest pause between attempts to connect
  int longest_pause_ms = 1000;
  bool queues_unconnected = true;  ///< if true, accepts messages while it is not connected
  bool is_worker = false;          ///< true for the workers' port, false for the clients' port
  /// The socket's key and the server's public key. With a key the connection is encrypted and only
  /// that server is accepted. Without a key the connection is plain text.
  std::optional<KeyFile> key = {};
};

/// Makes a DEALER socket with the options that all our sockets share (limits.h, the maximum frame
/// size). It does not connect yet. Throws solver::InputError if `url` is invalid or the key is a
/// server's key, and std::system_error if the process cannot start the threads of libzmq.
zmq::socket_t make_dealer(zmq::context_t& context, const DealerSettings& settings);

/// Starts to connect in the background, and again whenever a connection ends. A host name is
/// resolved each time, on libzmq's thread, which a closing context waits for. A name may have
/// addresses of both IP versions while the server listens on one version only. So an even `attempt`
/// uses IPv4 and an odd one IPv6. Throws the errors of `make_dealer`.
void connect(zmq::socket_t& socket, const DealerSettings& settings, unsigned attempt = 0);

/// Observes the connections of a socket with one peer: how often it was connected, and whether the
/// peer has rejected it. When a connection ends, messages that the socket has passed to it are
/// lost.
class SocketMonitor {
 public:
  /// `socket` must have been made with `settings` and must not be connected yet. `socket` and
  /// `context` must outlive this object.
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, DealerSettings settings);
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  /// Returns a ZeroMQ socket that becomes readable when results of the functions below may change.
  void* handle() { return events_.handle(); }

  /// Returns the number of connections so far that have completed their handshake.
  std::uint64_t connections();
  /// Returns why the peer has rejected the socket, and the remedy, without a full stop. A rejected
  /// socket does not connect again; make a new one.
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
