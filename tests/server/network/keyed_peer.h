#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

#include "tests/server/network/curve_client.h"

namespace oblique::server {

/// A raw TCP connection that shakes hands with a key. What it waits for and does not get throws.
class KeyedPeer {
 public:
  KeyedPeer(const std::string& endpoint, const CurveClient& keys) : tcp_(endpoint), curve_(keys) {
    tcp_.send(curve_greeting() + zmtp_command("HELLO", curve_.hello()));
    need(kGreetingBytes);
    heard_.erase(0, kGreetingBytes);
    const std::string welcome = next_frame();
    constexpr std::size_t kNameBytes = 8;
    if (!curve_.take_welcome(std::string_view(welcome).substr(kNameBytes))) {
      throw std::runtime_error("no WELCOME for this client");
    }
    tcp_.send(command_of("INITIATE", curve_.initiate()));
    if (!next_frame().starts_with("\x05READY")) {
      throw std::runtime_error("it was not let in");
    }
  }

  /// As a frame under seal.
  std::string sealed(std::string_view body, unsigned flags = 0) {
    return curve_.sealed(body, flags);
  }
  void send(std::string_view bytes) { tcp_.send(bytes); }
  /// The body of the next message.
  std::string receive() {
    const auto opened = curve_.opened_message(next_frame());
    if (!opened || opened->front() != '\0') {
      throw std::runtime_error("what came is no message");
    }
    return opened->substr(1);
  }
  void reset() { tcp_.reset(); }

 private:
  void need(std::size_t bytes) {
    while (heard_.size() < bytes) {
      const std::string more = tcp_.receive();
      if (more.empty()) {
        throw std::runtime_error("the server has ended the connection");
      }
      heard_ += more;
    }
  }
  std::string next_frame() {
    constexpr std::size_t kLongHeader = 9;
    need(2);
    const bool is_long = (static_cast<unsigned char>(heard_[0]) & kFrameLong) != 0;
    const std::size_t header = is_long ? kLongHeader : 2;
    need(header);
    const auto bytes =
        static_cast<std::size_t>(number_of(std::string_view(heard_).substr(1, header - 1)));
    need(header + bytes);
    const std::string body = heard_.substr(header, bytes);
    heard_.erase(0, header + bytes);
    return body;
  }

  RawPeer tcp_;
  CurveClient curve_;
  std::string heard_;
};

}  // namespace oblique::server
