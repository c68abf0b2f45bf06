#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <zmq.hpp>

#include "proto/socket/socket.h"

namespace oblique::protocol {

/// Why the other end ended a handshake with one of our sockets.
enum class Rejection {
  kKey,             ///< it does not admit our key at this port
  kServersKey,      ///< our file has another public key of the server than it has itself
  kOtherMechanism,  ///< it asks for keys and we have none, or the other way round
  kForNow,          ///< it has no room at present
  kNoServer,        ///< it does not speak as a server of ours
};

/// For people: who turned whom away, why, and what to do; without a full stop.
std::string sentence_of(Rejection rejection, const DealerSettings& settings);

/// What libzmq tells of the connections of a socket of one peer: how often it was connected, and
/// whether the other end has turned it away. What a socket has handed to a connection is lost with
/// that connection, and only this tells.
class SocketMonitor {
 public:
  /// `socket` must not be connected yet, and it and `context` must live as long. Whoever wants the
  /// attempts to connect too must ask often, for libzmq waits where too much of that is not taken.
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, bool with_attempts = false);
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  /// A ZeroMQ socket that is readable when something may have changed.
  void* handle() { return events_.handle(); }

  /// Connections made so far over which messages can pass, the present one included.
  std::uint64_t connections();
  /// Why the other end turned the socket away, which then does not try again: a new socket must.
  std::optional<Rejection> rejection();

  /// What became of attempts to connect; nothing unless asked for `with_attempts`.
  struct Attempts {
    bool was_accepted = false;  ///< something took a connection, whatever came over it
    unsigned failed = 0;
  };
  Attempts attempts();

 private:
  void take_events();

  zmq::socket_t& socket_;
  zmq::socket_t events_;
  std::uint64_t connections_ = 0;
  std::optional<Rejection> rejection_;
  Attempts attempts_;
};

}  // namespace oblique::protocol
