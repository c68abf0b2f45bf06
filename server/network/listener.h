#pragma once

#include <string>

#include "proto/system/descriptor.h"
#include "server/network/peer_address.h"

namespace oblique::server {

/// A TCP socket that takes connections, non-blocking.
class Listener {
 public:
  /// `address` is numeric, of IPv4 or IPv6, `port` a number or "*": the system picks one. At "::"
  /// it listens for both. Throws std::runtime_error, naming the endpoint, when it cannot listen
  /// there.
  Listener(const std::string& address, const std::string& port);

  /// With the port that is really used, as tcp://127.0.0.1:7601 or tcp://[::1]:7601.
  const std::string& endpoint() const { return endpoint_; }
  int descriptor() const { return socket_.number(); }

  struct Accepted {
    protocol::Descriptor socket;
    PeerAddress address;
  };
  /// The next connection, non-blocking; its socket is not open when none waits or the system gives
  /// none. Then `errno` says which.
  Accepted accept() const;

 private:
  protocol::Descriptor socket_;
  std::string endpoint_;
};

}  // namespace oblique::server
