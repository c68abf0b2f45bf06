#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "server/network/zmtp.h"
#include "tests/support/hang_limit.h"

namespace oblique::server {

inline std::string zmtp_greeting() {
  std::string bytes("\xff\0\0\0\0\0\0\0\0\x7f\x03\x01NULL", 16);
  bytes.resize(kGreetingBytes, '\0');
  return bytes;
}

/// A message, or with `more` a part of one.
inline std::string zmtp_frame(std::string_view body, bool more = false) {
  std::string bytes = message_header(body.size()).append(body);
  bytes[0] = static_cast<char>(static_cast<unsigned>(bytes[0]) | (more ? kFrameMore : 0U));
  return bytes;
}

inline std::string zmtp_properties(std::string_view socket_type) {
  return "\x0bSocket-Type" + std::string("\0\0\0", 3) + static_cast<char>(socket_type.size()) +
         std::string(socket_type);
}
inline std::string zmtp_ready(std::string_view socket_type) {
  return command_frame("READY", zmtp_properties(socket_type));
}
inline std::string zmtp_ping() {
  return command_frame("PING", std::string("\0\0context", 9));
}

/// A TCP connection to a server, without a protocol.
class RawPeer {
 public:
  /// To an endpoint as tcp://127.0.0.1:7601, from an IPv4 address of this machine. After the server
  /// has ended the connection `send` throws.
  explicit RawPeer(const std::string& endpoint, const char* source = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = inet_addr(source);
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("cannot bind");
    }
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
    const timeval longest{std::chrono::seconds(test::kHangLimit).count(), 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &longest, sizeof longest);
    setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &longest, sizeof longest);
    if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("cannot connect");
    }
  }
  ~RawPeer() {
    if (socket_ >= 0) {
      ::close(socket_);
    }
  }
  RawPeer(const RawPeer&) = delete;
  RawPeer& operator=(const RawPeer&) = delete;

  void shake_hands() { send(zmtp_greeting() + zmtp_ready("DEALER")); }
  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) {
        throw std::runtime_error("the server takes no more");
      }
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
  }
  /// Sends what the server takes at once; returns how many bytes.
  std::size_t send_what_fits(std::string_view bytes) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return sent < 0 ? 0 : static_cast<std::size_t>(sent);
  }
  /// Sends what the server takes at once of `frames`, then of their rest, and so on.
  void flood(const std::string& frames) {
    if (left_.empty()) {
      left_ = frames;
    }
    left_.erase(0, send_what_fits(left_));
  }
  /// Reads once; empty when the server has ended the connection.
  std::string receive(int flags = 0) {
    std::string bytes(65536, '\0');
    const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), flags);
    bytes.resize(static_cast<std::size_t>(count < 0 ? 0 : count));
    return bytes;
  }
  /// Reads what has come already, which may be nothing.
  std::string receive_what_is_there() { return receive(MSG_DONTWAIT); }
  /// Ends the connection as the system does for a killed process that left input unread.
  void reset() {
    const linger at_once{1, 0};
    setsockopt(socket_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    ::close(std::exchange(socket_, -1));
  }
  /// Reads until the server ends the connection.
  void await_end() {
    while (!receive().empty()) {
    }
  }

 private:
  int socket_;
  std::string left_;  // of a flood
};

}  // namespace oblique::server
