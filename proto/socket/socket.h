#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <zmq.hpp>

#include "proto/keys/key_file.h"

namespace oblique::protocol {

/// What differs between the sockets of workers and clients.
struct DealerSettings {
  std::string url;             ///< as tcp://127.0.0.1:7600
  std::string example_url;     ///< what an address looks like, for messages
  int linger_ms = 0;           ///< how long unsent messages are still sent after closing
  int shortest_pause_ms = 20;  ///< between attempts to connect
  int longest_pause_ms = 1000;
  bool queues_unconnected = true;  ///< takes messages while there is no connection
  bool is_worker = false;  ///< it connects to the port for workers, else to that for clients
  /// Its key, with the server's: everything is encrypted, and only that server is accepted. Empty:
  /// plain text with a server that has no keys.
  std::optional<KeyFile> key = {};
};

/// A DEALER socket with the options that all our sockets have (limits.h, the largest frame), which
/// does not connect yet. Throws solver::InputError for a `url` that is no address, and for a key
/// that is a server's.
zmq::socket_t make_dealer(zmq::context_t& context, const DealerSettings& settings);

/// Lets it connect, in the background, and again whenever a connection ends; a host's name is
/// looked up each time. A name may have addresses of both families, and the server need not listen
/// on both: each `attempt` tries the other one, IPv4 first. Throws solver::InputError as above.
void connect(zmq::socket_t& socket, const DealerSettings& settings, unsigned attempt = 0);

/// The connections of a socket of one peer: how often it was connected, and whether the other end
/// rejected it. What a socket has handed to a connection is lost with that connection.
class SocketMonitor {
 public:
  /// `socket`, which was made with `settings`, must not be connected yet, and it and `context` must
  /// live as long. With `with_attempts`, call `attempts` often: libzmq waits while too many events
  /// are not taken.
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, DealerSettings settings,
                bool with_attempts = false);
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  /// A ZeroMQ socket that is readable when something may have changed.
  void* handle() { return events_.handle(); }

  /// Connections made so far over which messages can pass, the present one included.
  std::uint64_t connections();
  /// Why the other end rejected the socket, and what to do; without a full stop. A rejected socket
  /// does not try again: a new one must.
  std::optional<std::string> rejection();

  /// The attempts to connect, `with_attempts`.
  struct Attempts {
    bool was_accepted = false;  ///< something took a connection, whatever came over it
    unsigned failed = 0;
  };
  Attempts attempts();

 private:
  /// An event that ended a handshake, and its value.
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
  Attempts attempts_;
};

}  // namespace oblique::protocol
