#pragma once

#include <optional>
#include <string>

#include <netinet/in.h>

#include "proto/system/descriptor.h"

namespace oblique::server {

/// The address from which a peer connects.
struct PeerAddress {
  PeerAddress() = default;
  /// Reads an IPv6 address, or a sockaddr_in that is stored in the same bytes. An IPv4-mapped
  /// address (::ffff:10.0.0.3) counts as IPv4.
  explicit PeerAddress(sockaddr_in6 address);

  std::string text;  ///< such as 10.0.0.3:4711 or [::1]:4711
  /// The IPv4 address, or the first 64 bits of an IPv6 address, because one host may have all
  /// addresses with these bits.
  std::string source;
};

/// Returns whether a numeric address is a loopback address; nothing for other text. The address may
/// name its interface, as in fe80::1%eth0.
std::optional<bool> is_loopback(const std::string& address);

/// A non-blocking TCP socket that accepts connections.
class Listener {
 public:
  /// `address` is numeric; `port` is a number, or "*" if the system chooses it. "::" accepts IPv4
  /// too. Throws std::runtime_error with the endpoint if it cannot listen.
  Listener(const std::string& address, const std::string& port);

  /// Returns the endpoint with the actual port, such as tcp://127.0.0.1:7601 or tcp://[::1]:7601.
  const std::string& endpoint() const { return endpoint_; }
  int descriptor() const { return socket_.number(); }

  struct Accepted {
    protocol::Descriptor socket;
    PeerAddress address;
  };
  /// Accepts the next connection without blocking. If no connection waits or the system refuses it,
  /// the returned socket is not open and `errno` has the reason.
  Accepted accept() const;

 private:
  protocol::Descriptor socket_;
  std::string endpoint_;
};

}  // namespace oblique::server
