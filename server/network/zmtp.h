#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/network/curve/peer.h"
#include "server/network/zmtp_words.h"

namespace oblique::server {

struct ZmtpMessage {
  std::string body;
  bool is_single;  ///< of one frame; of any other number nothing is kept
};

/// The server's end of one ZMTP 3 connection (rfc.zeromq.org 23 and 37), mechanism NULL or CURVE,
/// as a ROUTER socket speaks it, without a socket: bytes go in, messages and bytes to answer come
/// out. Every byte is hostile. Holds one whole message or one incomplete frame, besides what the
/// last `receive` brought, and of messages of several frames nothing.
class Zmtp {
 public:
  /// With a guard the mechanism is CURVE, and it must outlive this; without one it is NULL.
  explicit Zmtp(const PortGuard* guard = nullptr);

  /// Takes bytes as they come from the peer.
  void receive(std::string_view bytes);

  /// A whole message has come. Nothing after it is looked at before it is taken.
  bool has_message() const { return message_.has_value(); }
  /// Only with `has_message`.
  ZmtpMessage take_message();

  /// What is costly is done when its time has come: a step of a handshake with keys, some 0.1 ms,
  /// and the opening of a sealed frame, some 1 ns a byte. Nothing after it is looked at before.
  enum class Work { kNone, kHandshake, kSealedFrame };
  Work waiting_work() const { return work_; }
  /// Does it; nothing, where none waits.
  void do_work();

  /// What the protocol itself has to say since the last call: greeting, handshake, PONG, ERROR.
  /// Numbers of sealed frames grow, so it must go out before anything that is sealed later.
  std::string take_answers();
  /// A message as it goes over this connection. With a guard it is a copy, sealed, which must go
  /// out next; without one only what goes before it. Only when open.
  std::string header_or_sealed(std::string_view body);
  bool seals() const { return curve_ != nullptr; }

  /// Who the peer is has been settled, and it may send.
  bool is_open() const { return state_ == State::kOpen; }
  /// Its greeting has begun, and is not whole.
  bool is_greeting() const { return state_ == State::kGreeting && !pending().empty(); }
  /// Whose key it has shown; null without a guard, or before.
  std::shared_ptr<const KeyHolder> holder() const;
  /// The key. Only with a holder.
  const protocol::CurveKey& key() const { return curve_->key(); }
  /// Why the connection must be ended; empty: it need not.
  const std::string& fault() const { return fault_.reason; }
  RefusalCause cause() const { return fault_.cause; }
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
  void take_handshake(std::string_view name, std::string_view data);
  void take_curve_step(std::string_view name, std::string_view data);
  void take_sealed(std::string_view message);
  void take_properties(std::string_view properties);
  void answer(std::string_view name, std::string_view data);
  void answer_ping(std::string_view arguments);
  void fail(RefusalCause cause, std::string reason);
  bool discard();
  std::string_view pending() const { return std::string_view(buffer_).substr(begin_); }
  std::optional<Header> next_header();
  std::uint64_t longest(const Header& header) const;

  std::unique_ptr<CurvePeer> curve_;
  State state_ = State::kGreeting;
  std::string buffer_;
  std::size_t begin_ = 0;            // of what is not read yet, in the buffer
  std::uint64_t discard_bytes_ = 0;  // left of a frame that is not kept
  bool more_follow_ = false;         // the frame that is not kept is not the last of its message
  bool in_multipart_ = false;
  Work work_ = Work::kNone;  // with the frame at the buffer's beginning
  std::optional<ZmtpMessage> message_;
  std::string answers_;
  Refusal fault_;
};

}  // namespace oblique::server
