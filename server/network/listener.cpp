#include "server/network/listener.h"

#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "proto/socket/limits.h"

namespace oblique::server {
namespace {

bool takes_both_families(int socket) {
  const int no = 0;
  return setsockopt(socket, IPPROTO_IPV6, IPV6_V6ONLY, &no, sizeof no) == 0;
}

}  // namespace

Listener::Listener(const std::string& address, const std::string& port) {
  PeerAddress where(address,
                    port == "*" ? std::uint16_t{0} : static_cast<std::uint16_t>(std::stoi(port)));
  socket_ = protocol::Descriptor(
      ::socket(where.system()->sa_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_TCP));
  const int yes = 1;
  socklen_t bytes = where.bytes();
  const bool listens =
      socket_.is_open() && (!where.is_v6() || takes_both_families(socket_.number())) &&
      setsockopt(socket_.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
      bind(socket_.number(), where.system(), bytes) == 0 &&
      listen(socket_.number(), protocol::kWaitingConnections) == 0 &&
      getsockname(socket_.number(), where.system(), &bytes) == 0;
  if (!listens) {
    const int error = errno;
    throw std::runtime_error("cannot listen on tcp://" + where.text() + ": " +
                             std::strerror(error) +
                             (error == EADDRINUSE ? ": does a server run already?" : ""));
  }
  endpoint_ = "tcp://" + where.text();
}

Listener::Accepted Listener::accept() const {
  Accepted accepted;
  socklen_t bytes = PeerAddress::kMostBytes;
  accepted.socket = protocol::Descriptor(
      ::accept4(socket_.number(), accepted.address.system(), &bytes, SOCK_NONBLOCK | SOCK_CLOEXEC));
  return accepted;
}

}  // namespace oblique::server
