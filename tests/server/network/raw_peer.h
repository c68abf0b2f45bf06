#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

#include <sys/socket.h>

#include "server/network/zmtp.h"
#include "tests/support/raw_tcp.h"

namespace oblique::server {

inline std::string zmtp_greeting() {
  std::string bytes("\xff\0\0\0\0\0\0\0\0\x7f\x03\x01NULL", 16);
  bytes.resize(kGreetingBytes, '\0');
  return bytes;
}

/// Returns a frame with a whole message, or with a part of a message if `more` is true.
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

/// A TCP connection to a port of the server.
class RawPeer : public test::RawTcp {
 public:
  using RawTcp::RawTcp;

  void complete_handshake() { send(zmtp_greeting() + zmtp_ready("DEALER")); }
  /// Sends all bytes; throws if the server has ended the connection.
  void send(std::string_view bytes) {
    if (!send_all(bytes)) {
      throw std::runtime_error("the server accepts no more bytes");
    }
  }
  /// Sends as many bytes as the socket accepts without waiting. Returns the number of sent bytes.
  std::size_t send_what_fits(std::string_view bytes) {
    const ssize_t sent = ::send(number(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return sent < 0 ? 0 : static_cast<std::size_t>(sent);
  }
  /// Sends as much of `frames` as the socket accepts. Later calls send the rest.
  void flood(const std::string& frames) {
    if (left_.empty()) {
      left_ = frames;
    }
    left_.erase(0, send_what_fits(left_));
  }
  /// Reads received bytes without blocking.
  std::string receive_available() { return receive(MSG_DONTWAIT); }

 private:
  std::string left_;  // bytes that `flood` has not sent yet
};

}  // namespace oblique::server
