#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <variant>

#include <sodium.h>

#include "server/network/authenticator.h"

// The server's side of CurveZMQ (rfc.zeromq.org 26) with one peer, on libsodium. Works on the bytes
// of commands and frames; has no socket.
namespace oblique::server {

inline constexpr std::size_t kKeyBytes = std::tuple_size_v<protocol::CurveKey>;
inline constexpr std::size_t kMacBytes = crypto_box_MACBYTES;
inline constexpr std::size_t kCounterBytes = 8;       ///< size of the counter in a nonce
inline constexpr std::size_t kRandomNonceBytes = 16;  ///< size of the random part of a nonce

// Return the bytes with the type that libsodium uses.
inline const std::uint8_t* raw(std::string_view bytes) {
  return reinterpret_cast<const std::uint8_t*>(bytes.data());
}
inline std::uint8_t* raw(char* bytes) {
  return reinterpret_cast<std::uint8_t*>(bytes);
}

using CurveNonce = std::array<std::uint8_t, crypto_box_NONCEBYTES>;

/// `prefix` and `rest` must have 24 bytes together.
inline CurveNonce curve_nonce(std::string_view prefix, std::string_view rest) {
  CurveNonce nonce;
  std::copy(rest.begin(), rest.end(), std::copy(prefix.begin(), prefix.end(), nonce.begin()));
  return nonce;
}

inline std::uint64_t number_of(std::string_view big_endian) {
  std::uint64_t value = 0;
  for (const char byte : big_endian) {
    value = value << 8U | static_cast<std::uint8_t>(byte);
  }
  return value;
}

inline std::string big_endian_of(std::uint64_t value) {
  std::string bytes(kCounterBytes, '\0');
  for (auto byte = bytes.rbegin(); byte != bytes.rend(); ++byte, value >>= 8U) {
    *byte = static_cast<char>(value & 0xffU);
  }
  return bytes;
}

/// Secret bytes of one connection, wiped by the destructor. They are not locked in memory, because
/// thousands of connections would exceed the system's limit.
template <std::size_t kBytes>
class Secret {
 public:
  Secret() = default;
  Secret(const Secret&) = default;
  Secret& operator=(const Secret&) = default;
  ~Secret() { wipe(); }

  void wipe() { sodium_memzero(bytes_.data(), bytes_.size()); }
  const std::uint8_t* data() const { return bytes_.data(); }
  std::uint8_t* data() { return bytes_.data(); }

 private:
  std::array<std::uint8_t, kBytes> bytes_{};
};

/// Encrypts and decrypts messages after the handshake. The counters of both directions only
/// increase, so no message is accepted twice or out of order.
class CurveSession {
 public:
  /// Number of bytes that MESSAGE adds to a frame's body: name, counter, MAC and flags.
  static constexpr std::size_t kAddedBytes = 33;

  CurveSession(const Secret<kKeyBytes>& shared_key, std::uint64_t received_counter)
      : key_(shared_key), received_counter_(received_counter) {}

  /// Returns the data of READY with these properties. Must be called before the other functions.
  std::string ready(std::string_view properties);
  /// Appends a MESSAGE with this body to `out`.
  void seal(std::string_view body, std::string& out);
  /// Returns the decrypted body of a MESSAGE. Returns nothing unless the message comes from this
  /// peer, is new, and has a single frame.
  std::optional<std::string> open(std::string_view message);

 private:
  Secret<kKeyBytes> key_;
  std::uint64_t received_counter_;
  std::uint64_t sent_counter_ = 0;
};

/// The server's side of one handshake: the peer sends HELLO and then INITIATE. In between the
/// server stores only the key of the cookie. The cookie, which INITIATE returns, contains all other
/// state. So a command that was recorded on one connection is refused on another.
class CurveHandshake {
 public:
  /// `security` must outlive this object.
  explicit CurveHandshake(const PortSecurity& security) : security_(security) {}

  /// The data of WELCOME (after HELLO), the peer's properties (after INITIATE), or a refusal.
  using Outcome = std::variant<std::string, Refusal>;
  /// Handles a command with this name and data. Takes about 0.1 ms.
  Outcome take(std::string_view command, std::string_view data);
  /// Returns whether the peer has proved that it holds an admitted key. The functions below may be
  /// called only then.
  bool is_done() const { return session_.has_value(); }
  const std::shared_ptr<const KeyIdentity>& identity() const { return identity_; }
  const protocol::CurveKey& key() const { return key_; }
  CurveSession& session() { return *session_; }

 private:
  enum class Step { kHello, kInitiate, kNone };

  Outcome take_hello(std::string_view hello);
  Outcome take_initiate(std::string_view initiate);
  std::string welcome(std::string_view peers_key, const Secret<kKeyBytes>& hello_key);
  bool is_vouched(std::string_view vouch, const protocol::CurveKey& client_key,
                  const std::uint8_t* short_term_key,
                  const std::uint8_t* own_short_term_secret) const;

  const PortSecurity& security_;
  Step next_ = Step::kHello;
  Secret<kKeyBytes> cookie_key_;
  std::uint64_t hello_counter_ = 0;
  std::shared_ptr<const KeyIdentity> identity_;
  protocol::CurveKey key_{};
  std::optional<CurveSession> session_;
};

/// Returns the code for an ERROR command: "400" if the key is not admitted, "500" if the peer has a
/// wrong server key or violates the protocol, "300" if it may try again later. libzmq 4.3.4 reports
/// only three-digit codes to programs.
std::string_view error_code(RefusalCause cause);

}  // namespace oblique::server
