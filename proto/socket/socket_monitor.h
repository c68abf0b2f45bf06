#pragma once

#include <cstdint>
#include <optional>

#include <zmq.hpp>

#include "proto/socket/rejection.h"

namespace oblique::protocol {

/// What libzmq tells of the connections of a socket of one peer: how often it was connected, and
/// whether the other end has turned it away. What a socket has handed to a connection is lost with
/// that connection, and only this tells.
class SocketMonitor {
 public:
  /// `socket` must not be connected yet, and it and `context` must live as long.
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket);
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  /// A ZeroMQ socket that is readable when something may have changed.
  void* handle() { return events_.handle(); }

  /// Connections made so far over which messages can pass, the present one included.
  std::uint64_t connections();
  /// Why the other end turned the socket away, which then does not try again: a new socket must.
  std::optional<Rejection> rejection();

 private:
  void take_events();

  zmq::socket_t& socket_;
  zmq::socket_t events_;
  std::uint64_t connections_ = 0;
  std::optional<Rejection> rejection_;
};

}  // namespace oblique::protocol
