#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace oblique::server {

struct ZmtpMessage {
  std::string body;
  bool is_single;  ///< of one frame; of any other number nothing is kept
};

/// The server's end of one ZMTP 3 connection (rfc.zeromq.org 23 and 37, mechanism NULL) as a ROUTER
/// socket speaks it, without a socket: bytes go in, messages and bytes to answer come out. Every
/// byte is hostile. Holds one whole message or one incomplete frame, besides what the last
/// `receive` brought, and of messages of several frames nothing.
class Zmtp {
 public:
  Zmtp();

  /// Takes bytes as they come from the peer.
  void receive(std::string_view bytes);

  /// A whole message has come. Nothing after it is looked at before it is taken.
  bool has_message() const { return message_.has_value(); }
  /// Only with `has_message`.
  ZmtpMessage take_message();

  /// What the protocol itself has to say since the last call: greeting, READY, PONG.
  std::string take_answers();

  /// Greetings and READY were exchanged.
  bool is_open() const { return state_ == State::kOpen; }
  /// Why the connection must be ended; empty: it need not.
  const std::string& fault() const { return fault_; }
  /// Memory for what has come and was not taken.
  std::size_t held_bytes() const {
    return buffer_.capacity() + (message_ ? message_->body.capacity() : 0);
  }

 private:
  enum class State { kGreeting, kHandshake, kOpen };
  struct Header;

  void advance();
  bool take_greeting();
  bool take_frame();
  void take_command(std::string_view body);
  void take_ready(std::string_view properties);
  void answer_ping(std::string_view arguments);
  bool discard();
  std::string_view pending() const { return std::string_view(buffer_).substr(begin_); }
  std::optional<Header> next_header();

  State state_ = State::kGreeting;
  std::string buffer_;
  std::size_t begin_ = 0;            // of what is not read yet, in the buffer
  std::uint64_t discard_bytes_ = 0;  // left of a frame that is not kept
  bool more_follow_ = false;         // the frame that is not kept is not the last of its message
  bool in_multipart_ = false;
  std::optional<ZmtpMessage> message_;
  std::string answers_;
  std::string fault_;
};

/// What goes before the body of a message of one frame.
std::string zmtp_header(std::size_t body_bytes);

}  // namespace oblique::server
