#pragma once

#include <array>
#include <cstdint>
#include <string>

#include <netinet/in.h>

namespace oblique::server {

/// An IP address and a port, of either family.
class PeerAddress {
 public:
  PeerAddress() = default;
  /// Numeric, with or without the brackets of IPv6; a link-local one may name its interface, as
  /// fe80::1%eth0. Throws std::runtime_error for any other.
  PeerAddress(const std::string& address, std::uint16_t port);

  /// As 10.0.0.3:4711 or [::1]:4711; for IPv4 that came by an IPv6 socket as for IPv4.
  std::string text() const;
  /// The IPv4 address, or the first 64 bits of an IPv6 address: one host can have all of the rest.
  using Source = std::array<std::uint8_t, 16>;
  Source source() const;
  bool is_v6() const { return address_.sin6_family == AF_INET6; }

  // As the system takes them and gives them back.
  sockaddr* system() { return reinterpret_cast<sockaddr*>(&address_); }
  const sockaddr* system() const { return reinterpret_cast<const sockaddr*>(&address_); }
  static constexpr socklen_t kMostBytes = sizeof(sockaddr_in6);
  socklen_t bytes() const { return is_v6() ? sizeof(sockaddr_in6) : sizeof(sockaddr_in); }

 private:
  sockaddr_in6 address_{};  // large enough for either
};

}  // namespace oblique::server
