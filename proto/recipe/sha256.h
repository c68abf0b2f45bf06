#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace oblique::protocol {

/// SHA-256 of bytes that come in pieces (FIPS 180-4).
class Sha256 {
 public:
  using Digest = std::array<std::uint8_t, 32>;

  void add(std::string_view bytes);
  /// Of all that was added; nothing may be added afterwards.
  Digest digest();

 private:
  static constexpr std::size_t kBlock = 64;
  void take(const unsigned char* block);

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<unsigned char, kBlock> rest_{};
  std::uint64_t bytes_ = 0;
};

/// Two digits a byte, as `sha256sum` prints it.
std::string hexadecimal(const Sha256::Digest& digest);

}  // namespace oblique::protocol
