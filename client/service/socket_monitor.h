#pragma once

#include <cstdint>

#include <zmq.hpp>

namespace oblique::client {

/// Counts how often a socket of one peer was connected to it. What a socket has handed to a
/// connection is lost with that connection, and only this tells.
class SocketMonitor {
 public:
  /// `socket` must not be connected yet, and it and `context` must live as long.
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket);
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  /// A ZeroMQ socket that is readable when `connections` may have changed.
  void* handle() { return events_.handle(); }

  /// Connections made so far over which messages can pass, the present one included.
  std::uint64_t connections();

 private:
  zmq::socket_t& socket_;
  zmq::socket_t events_;
  std::uint64_t connections_ = 0;
};

}  // namespace oblique::client
