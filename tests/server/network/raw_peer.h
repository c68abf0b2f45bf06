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

#include "tests/support/hang_limit.h"

namespace oblique::server {

// ---- ZMTP by hand, so that a test can say what no library says
// ------------------------------------

inline std::string zmtp_greeting() {
  std::string bytes("\xff\0\0\0\0\0\0\0\0\x7f\x03\x01NULL", 16);
  bytes.resize(64, '\0');
  return bytes;
}

/// A message of that body, or with `more` a part of one.
inline std::string zmtp_frame(std::string_view body, bool more = false) {
  std::string bytes;
  if (body.size() < 256) {
    bytes += static_cast<char>(more ? 1 : 0);
    bytes += static_cast<char>(body.size());
  } else {
    bytes += static_cast<char>(more ? 3 : 2);
    for (int shift = 56; shift >= 0; shift -= 8) {
      bytes += static_cast<char>(static_cast<std::uint64_t>(body.size()) >> shift & 0xffU);
    }
  }
  return bytes += body;
}

/// A command of at most 255 bytes.
inline std::string zmtp_command(std::string_view name, std::string_view data) {
  std::string bytes = "\x04";
  bytes += static_cast<char>(1 + name.size() + data.size());
  bytes += static_cast<char>(name.size());
  return (bytes += name) += data;
}

inline std::string zmtp_ready(std::string_view socket_type) {
  std::string property = "\x0bSocket-Type";
  property += std::string("\0\0\0", 3);
  property += static_cast<char>(socket_type.size());
  return zmtp_command("READY", property += socket_type);
}

inline std::string zmtp_ping(std::string_view context) {
  return zmtp_command("PING", std::string("\0\0", 2).append(context));
}

/// A TCP connection to a server that does what it is told to and nothing else.
class RawPeer {
 public:
  /// To an endpoint as tcp://127.0.0.1:7601, from an IPv4 address of this machine. A connection
  /// that the server ends makes `send` throw.
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
  /// Sends what the server takes at once of `frames`, then of what was left of them, and so on.
  void flood(const std::string& frames) {
    if (left_.empty()) {
      left_ = frames;
    }
    left_.erase(0, send_what_fits(left_));
  }
  /// Reads once; empty when the server has ended the connection.
  std::string receive() {
    std::string bytes(65536, '\0');
    const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), 0);
    bytes.resize(static_cast<std::size_t>(count < 0 ? 0 : count));
    return bytes;
  }
  /// Reads what has come already, which may be nothing.
  std::string receive_what_is_there() {
    std::string bytes(65536, '\0');
    const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    bytes.resize(static_cast<std::size_t>(count < 0 ? 0 : count));
    return bytes;
  }
  /// Ends the connection as the system does for a killed process that left something unread.
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
