#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <sodium.h>

namespace oblique::server {

/// Bytes as libsodium takes them.
inline const std::uint8_t* raw(std::string_view bytes) {
  return reinterpret_cast<const std::uint8_t*>(bytes.data());
}
inline std::uint8_t* raw(char* bytes) {
  return reinterpret_cast<std::uint8_t*>(bytes);
}

inline constexpr std::size_t kMacBytes = crypto_box_MACBYTES;
inline constexpr std::size_t kCountedNonceBytes = 8;
inline constexpr std::size_t kRandomNonceBytes = 16;

using CurveNonce = std::array<std::uint8_t, crypto_box_NONCEBYTES>;

/// `prefix` and `rest` have 24 bytes together.
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

inline std::array<char, kCountedNonceBytes> big_endian_of(std::uint64_t value) {
  std::array<char, kCountedNonceBytes> bytes;
  for (auto byte = bytes.rbegin(); byte != bytes.rend(); ++byte, value >>= 8U) {
    *byte = static_cast<char>(value & 0xffU);
  }
  return bytes;
}

}  // namespace oblique::server
