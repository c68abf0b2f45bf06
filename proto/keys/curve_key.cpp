#include "proto/keys/curve_key.h"

#include <limits>
#include <stdexcept>

#include <sodium.h>

namespace oblique::protocol {
namespace {

constexpr std::string_view kDigits =
    "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.-:+=^!/*?&<>()[]{}@%$#";
constexpr std::size_t kBytesOfGroup = 4;
constexpr std::size_t kDigitsOfGroup = 5;

}  // namespace

KeyPair made_key_pair() {
  static_assert(std::tuple_size_v<CurveKey> == crypto_box_PUBLICKEYBYTES);
  static_assert(std::tuple_size_v<CurveKey> == crypto_box_SECRETKEYBYTES);
  if (sodium_init() < 0) {
    throw std::runtime_error("no key can be made: the system gives no random numbers");
  }
  KeyPair pair;
  crypto_box_keypair(pair.public_key.data(), pair.secret_key.data());
  return pair;
}

CurveKey public_half_of(const CurveKey& secret_key) {
  CurveKey public_key{};
  crypto_scalarmult_base(public_key.data(), secret_key.data());
  return public_key;
}

// Four bytes are one number, the first byte its highest, and so are five digits.
std::string z85(const CurveKey& key) {
  std::string text;
  for (std::size_t at = 0; at < key.size(); at += kBytesOfGroup) {
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < kBytesOfGroup; ++i) {
      number = number << 8U | key.at(at + i);
    }
    std::string group(kDigitsOfGroup, '0');
    for (std::size_t i = kDigitsOfGroup; i > 0; --i) {
      group[i - 1] = kDigits[number % kDigits.size()];
      number /= static_cast<std::uint32_t>(kDigits.size());
    }
    text += group;
  }
  return text;
}

std::optional<CurveKey> key_of_z85(std::string_view text) {
  if (text.size() != kKeyCharacters) {
    return std::nullopt;
  }
  CurveKey key{};
  for (std::size_t group = 0; group < text.size() / kDigitsOfGroup; ++group) {
    std::uint64_t number = 0;
    for (const char digit : text.substr(group * kDigitsOfGroup, kDigitsOfGroup)) {
      const std::size_t value = kDigits.find(digit);
      if (value == std::string_view::npos) {
        return std::nullopt;
      }
      number = number * kDigits.size() + value;
    }
    if (number > std::numeric_limits<std::uint32_t>::max()) {
      return std::nullopt;
    }
    for (std::size_t i = kBytesOfGroup; i > 0; --i) {
      key.at(group * kBytesOfGroup + i - 1) = static_cast<std::uint8_t>(number & 0xffU);
      number >>= 8U;
    }
  }
  return key;
}

}  // namespace oblique::protocol
