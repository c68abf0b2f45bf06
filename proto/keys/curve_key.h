#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace oblique::protocol {

/// One half of a CURVE key pair (Curve25519): 32 bytes.
using CurveKey = std::array<std::uint8_t, 32>;

/// Characters of a key in files and in ZeroMQ's options (Z85, rfc.zeromq.org 32).
inline constexpr std::size_t kKeyCharacters = 40;

struct KeyPair {
  CurveKey public_key{};
  CurveKey secret_key{};
};

/// A pair that nobody else has. Throws std::runtime_error when the system gives no random numbers.
KeyPair made_key_pair();

/// The public half that belongs to a secret one.
CurveKey public_half_of(const CurveKey& secret_key);

/// A key as 40 printable characters, none of which is a quote, a backslash or a space.
std::string z85(const CurveKey& key);

/// None unless `text` is 40 characters that stand for 32 bytes.
std::optional<CurveKey> key_of_z85(std::string_view text);

}  // namespace oblique::protocol
