#include "server/network/listener.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "proto/socket/limits.h"

namespace oblique::server {
namespace {

/// An address of either family, as the system takes it.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t bytes = 0;

  sockaddr* any() { return reinterpret_cast<sockaddr*>(&storage); }
  int family() const { return storage.ss_family; }
  std::uint16_t port() const {
    // In both families the port stands at the same place.
    return ntohs(reinterpret_cast<const sockaddr_in*>(&storage)->sin_port);
  }
};

SocketAddress address_of(const std::string& address, std::uint16_t port) {
  SocketAddress result;
  auto* const v4 = reinterpret_cast<sockaddr_in*>(&result.storage);
  auto* const v6 = reinterpret_cast<sockaddr_in6*>(&result.storage);
  if (inet_pton(AF_INET, address.c_str(), &v4->sin_addr) == 1) {
    v4->sin_family = AF_INET;
    v4->sin_port = htons(port);
    result.bytes = sizeof *v4;
  } else if (inet_pton(AF_INET6, address.c_str(), &v6->sin6_addr) == 1) {
    v6->sin6_family = AF_INET6;
    v6->sin6_port = htons(port);
    result.bytes = sizeof *v6;
  } else {
    throw std::runtime_error(address + " is no numeric address");
  }
  return result;
}

std::string endpoint_of(const std::string& address, const std::string& port) {
  const bool is_v6 = address.find(':') != std::string::npos;
  return "tcp://" + (is_v6 ? "[" + address + "]" : address) + ":" + port;
}

}  // namespace

Listener::Listener(const std::string& address, const std::string& port) {
  SocketAddress where = address_of(
      address, port == "*" ? std::uint16_t{0} : static_cast<std::uint16_t>(std::stoi(port)));
  socket_ = protocol::Descriptor(
      ::socket(where.family(), SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_TCP));
  const int yes = 1;
  const bool listens =
      socket_.is_open() &&
      setsockopt(socket_.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
      bind(socket_.number(), where.any(), where.bytes) == 0 &&
      listen(socket_.number(), protocol::kWaitingConnections) == 0 &&
      getsockname(socket_.number(), where.any(), &where.bytes) == 0;
  if (!listens) {
    const int error = errno;
    throw std::runtime_error("cannot listen on " + endpoint_of(address, port) + ": " +
                             std::strerror(error) +
                             (error == EADDRINUSE ? ": does a server run already?" : ""));
  }
  endpoint_ = endpoint_of(address, std::to_string(where.port()));
}

protocol::Descriptor Listener::accept() const {
  return protocol::Descriptor(
      ::accept4(socket_.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
}

}  // namespace oblique::server
