#pragma once

#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>

#include "proto/system/descriptor.h"
#include "tests/support/hang_limit.h"

namespace oblique::test {

/// A TCP connection to a server on 127.0.0.1, for raw bytes.
class RawTcp {
 public:
  /// `endpoint` ends with :PORT, such as tcp://127.0.0.1:7601. `source` is the local IPv4 address,
  /// which the server sees.
  explicit RawTcp(const std::string& endpoint, const std::string& source = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const auto port =
        static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1)));
    const sockaddr_in own = address_of(source, 0);
    const sockaddr_in other = address_of("127.0.0.1", port);
    const timeval longest{std::chrono::seconds(kHangLimit).count(), 0};
    setsockopt(number(), SOL_SOCKET, SO_RCVTIMEO, &longest, sizeof longest);
    setsockopt(number(), SOL_SOCKET, SO_SNDTIMEO, &longest, sizeof longest);
    if (::bind(number(), reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0 ||
        ::connect(number(), reinterpret_cast<const sockaddr*>(&other), sizeof other) != 0) {
      throw std::runtime_error(std::string("cannot connect: ") + std::strerror(errno));
    }
  }

  /// Sends all bytes. Returns false if the server has closed the connection.
  bool send_all(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0 && errno != EINTR) {
        return false;
      }
      bytes.remove_prefix(static_cast<std::size_t>(sent < 0 ? 0 : sent));
    }
    return true;
  }
  /// Returns the bytes of one read; empty if the server has closed the connection.
  std::string receive(int flags = 0, std::size_t most = 65536) {
    std::string bytes(most, '\0');
    ssize_t count = 0;
    do {  // the end of a child process interrupts a recv() that has a timeout
      count = ::recv(number(), bytes.data(), bytes.size(), flags);
    } while (count < 0 && errno == EINTR);
    if (count < 0 && errno == EAGAIN && (flags & MSG_DONTWAIT) == 0) {
      throw std::runtime_error("the server neither answers nor closes the connection");
    }
    bytes.resize(static_cast<std::size_t>(count < 0 ? 0 : count));
    return bytes;
  }
  /// Returns all bytes until the server closes the connection.
  std::string read_to_the_end() {
    std::string all;
    for (std::string some = receive(); !some.empty(); some = receive()) {
      all += some;
    }
    return all;
  }
  /// Resets the connection, as the system does for a killed process with unread input.
  void reset() {
    const linger at_once{1, 0};
    setsockopt(number(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    socket_.close();
  }
  int number() const { return socket_.number(); }

 private:
  static sockaddr_in address_of(const std::string& text, std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    inet_pton(AF_INET, text.c_str(), &address.sin_addr);
    return address;
  }

  protocol::Descriptor socket_;
};

}  // namespace oblique::test
