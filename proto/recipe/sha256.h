#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include <sodium/crypto_hash_sha256.h>

namespace oblique::protocol {

/// SHA-256 of bytes that come in pieces (FIPS 180-4), as libsodium computes it.
class Sha256 {
 public:
  using Digest = std::array<std::uint8_t, crypto_hash_sha256_BYTES>;

  Sha256();
  void add(std::string_view bytes);
  /// Of all that was added; nothing may be added afterwards.
  Digest digest();

 private:
  crypto_hash_sha256_state state_;
};

/// Two digits a byte, as `sha256sum` prints it.
std::string hexadecimal(const Sha256::Digest& digest);

}  // namespace oblique::protocol
