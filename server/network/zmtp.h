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

/// Returns the server's greeting for the mechanism "NULL" or "CURVE".
std::string greeting_of(std::string_view mechanism);
/// Returns the header of a message with a single frame.
std::string message_header(std::size_t body_bytes);
/// Returns a command, encoded as a frame.
std::string command_frame(std::string_view name, std::string_view data);

/// The server's side of one ZMTP 3 connection (rfc.zeromq.org 23 and 37) with mechanism NULL or
/// CURVE, as a ROUTER socket. It has no socket of its own: the caller passes received bytes in, and
/// takes messages and answers out. Stores at most one complete message or one incomplete frame,
/// besides the bytes of the last `receive`. Messages of several frames, and commands after the
/// handshake such as heartbeats, are faults, because our peers never send them.
class Zmtp {
 public:
  /// With `security` the mechanism is CURVE, else NULL. `security` must outlive this object.
  explicit Zmtp(const PortSecurity* security = nullptr);

  /// Adds bytes that were received from the peer.
  void receive(std::string_view bytes);

  /// Returns whether a complete message waits. Later bytes are not examined until it has been
  /// taken.
  bool has_message() const { return message_.has_value(); }
  /// Takes the waiting message. There must be one.
  std::string take_message();

  /// Expensive work that waits until the caller runs it: a handshake step, about 0.1 ms, or the
  /// decryption of a frame, about 1 ns per byte. Later bytes are not examined until it has run.
  enum class PendingStep { kNone, kHandshake, kSealedFrame };
  PendingStep pending_step() const { return pending_step_; }
  /// Runs the pending step, if there is one.
  void run_step();

  /// Returns the greeting and handshake answers that were made since the last call.
  std::string take_answers();
  /// Begins a message to the peer on an open connection. Returns the bytes to send before `body`.
  /// With keys the result is the whole encrypted frame, and `body` becomes empty. Frames must be
  /// sent in the order of these calls.
  std::string begin_message(std::string_view& body);

  /// Returns whether the handshake is done.
  bool is_open() const { return state_ == State::kOpen; }
  /// Returns whether a part of the peer's greeting was received.
  bool is_greeting() const { return state_ == State::kGreeting && !pending().empty(); }
  /// Returns name and role of the peer's key; null without keys and before the connection is open.
  std::shared_ptr<const KeyIdentity> identity() const;
  /// Returns the peer's key. Must be called only if `identity` is not null.
  const protocol::CurveKey& key() const { return curve_->key(); }
  /// Returns why the connection must be ended; empty if it need not.
  const std::string& fault() const { return fault_.reason; }
  RefusalCause cause() const { return fault_.cause; }
  /// Returns the size of bytes and messages that were not taken [bytes].
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
  std::size_t begin_ = 0;                          // start of the unexamined bytes in `buffer_`
  PendingStep pending_step_ = PendingStep::kNone;  // how to process the frame at `begin_`
  std::optional<std::string> message_;
  std::string answers_;
  Refusal fault_;
};

}  // namespace oblique::server
