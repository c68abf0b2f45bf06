#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace oblique::test {

/// A port of 127.0.0.1 that the system gives to no other program while this object exists.
/// Connections are refused until a ZeroMQ socket of any process binds to the port by number.
/// Several sockets may bind to the port one after another.
class ReservedPort {
 public:
  ReservedPort() : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const int yes = 1;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const any_address = reinterpret_cast<sockaddr*>(&address);
    // Sockets with this option may share a port if at most one of them listens.
    if (setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
        bind(socket_, any_address, size) != 0 || getsockname(socket_, any_address, &size) != 0) {
      throw std::runtime_error(std::string("cannot reserve a port: ") + std::strerror(errno));
    }
    number_ = std::to_string(ntohs(address.sin_port));
  }
  ~ReservedPort() { close(socket_); }
  ReservedPort(const ReservedPort&) = delete;
  ReservedPort& operator=(const ReservedPort&) = delete;

  const std::string& number() const { return number_; }
  std::string url() const { return "tcp://127.0.0.1:" + number_; }

 private:
  int socket_;
  std::string number_;
};

}  // namespace oblique::test
