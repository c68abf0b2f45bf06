#pragma once

#include <optional>
#include <string>

#include <netinet/in.h>

#include "proto/system/descriptor.h"

namespace oblique::server {

/// Where a peer connects from.
struct PeerAddress {
  PeerAddress() = default;
  /// Of IPv6, or a sockaddr_in in the same place. IPv4 that an IPv6 socket gave
  /// (::ffff:10.0.0.3) counts as IPv4.
  explicit PeerAddress(sockaddr_in6 address);

  std::string text;  ///< as 10.0.0.3:4711 or [::1]:4711
  /// The IPv4 address, or the first 64 bits of an IPv6 address: one host can have all of the rest.
  std::string source;
};

/// Whether only this machine can reach a numeric address, which may name its interface as in
/// fe80::1%eth0; nothing for other text.
std::optional<bool> is_loopback(const std::string& address);

/// A non-blocking TCP socket that accepts connections.
class Listener {
 public:
  /// `address` is numeric, `port` a number or "*": the system picks one. At "::" it accepts IPv4
  /// too. Throws std::runtime_error, with the endpoint, when it cannot listen there.
  Listener(const std::string& address, const std::string& port);

  /// With the port in use, as tcp://127.0.0.1:7601 or tcp://[::1]:7601.
  const std::string& endpoint() const { return endpoint_; }
  int descriptor() const { return socket_.number(); }

  struct Accepted {
    protocol::Descriptor socket;
    PeerAddress address;
  };
  /// The next connection, non-blocking. If none waits or the system refuses one, its socket is not
  /// open and `errno` says why.
  Accepted accept() const;

 private:
  protocol::Descriptor socket_;
  std::string endpoint_;
};

}  // namespace oblique::server
