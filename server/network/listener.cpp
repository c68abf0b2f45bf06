#include "server/network/listener.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <utility>

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include <spdlog/fmt/fmt.h>

namespace oblique::server {
namespace {

sockaddr* generic(sockaddr_in6& address) {
  return reinterpret_cast<sockaddr*>(&address);
}

}  // namespace

PeerAddress::PeerAddress(sockaddr_in6 address) {
  constexpr std::size_t kNetworkBytes = 8;
  constexpr std::size_t kV4At = 12;
  const auto* const v6 = reinterpret_cast<const char*>(address.sin6_addr.s6_addr);
  if (address.sin6_family == AF_INET6 && IN6_IS_ADDR_V4MAPPED(&address.sin6_addr)) {
    sockaddr_in v4{};
    v4.sin_family = AF_INET;
    v4.sin_port = address.sin6_port;
    std::memcpy(&v4.sin_addr, v6 + kV4At, sizeof v4.sin_addr);
    std::memcpy(&address, &v4, sizeof v4);
  }
  std::array<char, NI_MAXHOST> host{};
  std::array<char, NI_MAXSERV> port{};
  getnameinfo(generic(address), sizeof address, host.data(), host.size(), port.data(), port.size(),
              NI_NUMERICHOST | NI_NUMERICSERV);
  const bool is_v6 = address.sin6_family == AF_INET6;
  text = fmt::format(fmt::runtime(is_v6 ? "[{}]:{}" : "{}:{}"), host.data(), port.data());
  source = is_v6 ? std::string(v6, kNetworkBytes) : std::string(host.data());
}

std::optional<bool> is_loopback(const std::string& address) {
  in_addr v4{};
  in6_addr v6{};
  if (inet_pton(AF_INET, address.c_str(), &v4) == 1) {
    return (ntohl(v4.s_addr) >> 24U) == 127;
  }
  if (inet_pton(AF_INET6, address.substr(0, address.find('%')).c_str(), &v6) == 1) {
    return IN6_IS_ADDR_LOOPBACK(&v6);
  }
  return std::nullopt;
}

Listener::Listener(const std::string& address, const std::string& port) {
  addrinfo hints{};
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(address.c_str(), port == "*" ? "0" : port.c_str(), &hints, &found) != 0) {
    throw std::runtime_error(
        fmt::format("cannot listen on {} port {}: not a numeric address", address, port));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owned(found, &freeaddrinfo);
  sockaddr_in6 own{};
  std::memcpy(&own, found->ai_addr, found->ai_addrlen);
  socket_ = protocol::Descriptor(
      ::socket(found->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_TCP));
  constexpr int kWaitingConnections = 1024;
  const int yes = 1;
  const int no = 0;
  socklen_t bytes = sizeof own;
  const bool listens =
      socket_.is_open() &&
      (found->ai_family == AF_INET ||
       setsockopt(socket_.number(), IPPROTO_IPV6, IPV6_V6ONLY, &no, sizeof no) == 0) &&
      setsockopt(socket_.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
      bind(socket_.number(), found->ai_addr, found->ai_addrlen) == 0 &&
      listen(socket_.number(), kWaitingConnections) == 0 &&
      getsockname(socket_.number(), generic(own), &bytes) == 0;
  if (!listens) {
    const int error = errno;
    throw std::runtime_error(
        fmt::format("cannot listen on tcp://{}: {}{}", PeerAddress(own).text, std::strerror(error),
                    error == EADDRINUSE ? ": another server may be running" : ""));
  }
  endpoint_ = "tcp://" + PeerAddress(own).text;
}

Listener::Accepted Listener::accept() const {
  sockaddr_in6 from{};
  socklen_t bytes = sizeof from;
  protocol::Descriptor socket(
      ::accept4(socket_.number(), generic(from), &bytes, SOCK_NONBLOCK | SOCK_CLOEXEC));
  return socket.is_open() ? Accepted{std::move(socket), PeerAddress(from)} : Accepted{};
}

}  // namespace oblique::server
