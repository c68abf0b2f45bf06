#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/network/curve.h"

namespace oblique::server {

// Bits of a frame's first byte.
inline constexpr unsigned kFrameMore = 1;
inline constexpr unsigned kFrameLong = 2;
inline constexpr unsigned kFrameCommand = 4;

inline constexpr std::size_t kGreetingBytes = 64;

/// The server's greeting, for the mechanism "NULL" or "CURVE".
std::string greeting_of(std::string_view mechanism);
/// The header of a message of one frame.
std::string message_header(std::size_t body_bytes);
/// A command as a frame.
std::string command_frame(std::string_view name, std::string_view data);

/// The server's end of one ZMTP 3 connection (rfc.zeromq.org 23 and 37), mechanism NULL or CURVE,
/// as a ROUTER socket would act, without a socket: bytes go in, messages and answers come out.
/// Holds one whole message or one incomplete frame, besides what the last `receive` brought.
/// Messages of several frames and commands after the handshake, heartbeats too, are faults: no peer
/// of ours sends them.
class Zmtp {
 public:
  /// With `security` the mechanism is CURVE, and `security` must outlive this; else it is NULL.
  explicit Zmtp(const PortSecurity* security = nullptr);

  /// Takes bytes as they come from the peer.
  void receive(std::string_view bytes);

  /// A whole message has come. What follows it is not examined before it is taken.
  bool has_message() const { return message_.has_value(); }
  /// Only with `has_message`.
  std::string take_message();

  /// Costly work waits until the caller runs it: a step of a handshake with keys, about 0.1 ms, or
  /// the decryption of a frame, about 1 ns a byte. What follows is not examined before.
  enum class PendingStep { kNone, kHandshake, kSealedFrame };
  PendingStep pending_step() const { return pending_step_; }
  /// Without a pending step it does nothing.
  void run_step();

  /// Greeting and answers of the handshake since the last call.
  std::string take_answers();
  /// Begins a message to the peer, once the connection is open: returns what is sent before `body`.
  /// With keys that is the whole encrypted frame, and `body` becomes empty. Frames must be sent in
  /// the order in which they were begun.
  std::string begin_message(std::string_view& body);

  /// The handshake is done.
  bool is_open() const { return state_ == State::kOpen; }
  /// Part of the peer's greeting has come.
  bool is_greeting() const { return state_ == State::kGreeting && !pending().empty(); }
  /// With which name and role the peer's key is listed. Null without keys, and before it is open.
  std::shared_ptr<const KeyIdentity> identity() const;
  /// The peer's key. Only with an identity.
  const protocol::CurveKey& key() const { return curve_->key(); }
  /// Why the connection must be ended; empty if it need not.
  const std::string& fault() const { return fault_.reason; }
  RefusalCause cause() const { return fault_.cause; }
  /// Memory for bytes and messages that were not taken.
  std::size_t held_bytes() const {
    return buffer_.capacity() + (message_ ? message_->capacity() : 0);
  }

 private:
  enum class State { kGreeting, kHandshake, kOpen };
  struct Header;

  void advance();
  bool take_greeting();
  std::optional<Header> next_header();
  bool take_frame();
  void take_command(std::string_view body);
  bool take_properties(std::string_view properties);
  void fail(std::string reason, RefusalCause cause = RefusalCause::kFaulty);
  std::string_view pending() const { return std::string_view(buffer_).substr(begin_); }

  std::unique_ptr<CurveHandshake> curve_;
  State state_ = State::kGreeting;
  std::string buffer_;
  std::size_t begin_ = 0;  // of the bytes in the buffer that were not examined
  PendingStep pending_step_ = PendingStep::kNone;  // of the frame at `begin_`
  std::optional<std::string> message_;
  std::string answers_;
  Refusal fault_;
};

}  // namespace oblique::server
