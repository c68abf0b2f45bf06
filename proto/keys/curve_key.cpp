#include "proto/keys/curve_key.h"

#include <algorithm>
#include <limits>
#include <new>
#include <stdexcept>

#include <sodium.h>

namespace oblique::protocol {
namespace {

constexpr std::string_view kDigits =
    "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.-:+=^!/*?&<>()[]{}@%$#";
constexpr std::size_t kBytesOfGroup = 4;
constexpr std::size_t kDigitsOfGroup = 5;

/// False unless `text` stands for a key.
bool decode_z85(std::string_view text, SecretKey::Bytes key) {
  if (text.size() != kKeyCharacters) {
    return false;
  }
  for (std::size_t group = 0; group < text.size() / kDigitsOfGroup; ++group) {
    std::uint64_t number = 0;
    for (const char digit : text.substr(group * kDigitsOfGroup, kDigitsOfGroup)) {
      const std::size_t value = kDigits.find(digit);
      if (value == std::string_view::npos) {
        return false;
      }
      number = number * kDigits.size() + value;
    }
    if (number > std::numeric_limits<std::uint32_t>::max()) {
      return false;
    }
    for (std::size_t i = kBytesOfGroup; i > 0; --i) {
      key[group * kBytesOfGroup + i - 1] = static_cast<std::uint8_t>(number & 0xffU);
      number >>= 8U;
    }
  }
  return true;
}

/// In the order of `Role`.
constexpr std::array<std::string_view, 4> kRoles{"server", "client", "worker", "reader"};

}  // namespace

std::string_view name_of(Role role) {
  return kRoles.at(static_cast<std::size_t>(role));
}

std::optional<Role> role_named(std::string_view name) {
  const auto* const found = std::find(kRoles.begin(), kRoles.end(), name);
  return found == kRoles.end() ? std::nullopt
                               : std::optional(static_cast<Role>(found - kRoles.begin()));
}

SecretKey::SecretKey() {
  if (sodium_init() < 0) {
    throw std::runtime_error("no keys can be used: the system gives no random numbers");
  }
  bytes_.reset(static_cast<std::uint8_t*>(sodium_malloc(Bytes::extent)), sodium_free);
  if (!bytes_) {
    throw std::bad_alloc();
  }
  std::fill_n(bytes_.get(), Bytes::extent, std::uint8_t{0});
}

bool SecretKey::operator==(const SecretKey& other) const {
  return sodium_memcmp(data(), other.data(), Bytes::extent) == 0;
}

KeyPair made_key_pair() {
  static_assert(std::tuple_size_v<CurveKey> == crypto_box_PUBLICKEYBYTES);
  static_assert(std::tuple_size_v<CurveKey> == crypto_box_SECRETKEYBYTES);
  KeyPair pair;
  crypto_box_keypair(pair.public_key.data(), pair.secret_key.bytes().data());
  return pair;
}

CurveKey public_half_of(const SecretKey& secret_key) {
  CurveKey public_key{};
  crypto_scalarmult_base(public_key.data(), secret_key.data());
  return public_key;
}

// Four bytes are one number, the first byte its highest, and so are five digits.
std::string z85(SecretKey::ConstBytes key) {
  std::string text;
  text.reserve(kKeyCharacters);  // growing would leave parts of a secret key behind
  for (std::size_t at = 0; at < key.size(); at += kBytesOfGroup) {
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < kBytesOfGroup; ++i) {
      number = number << 8U | key[at + i];
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
  CurveKey key{};
  return decode_z85(text, key) ? std::optional(key) : std::nullopt;
}

std::optional<SecretKey> secret_key_of_z85(std::string_view text) {
  SecretKey key;
  return decode_z85(text, key.bytes()) ? std::optional(key) : std::nullopt;
}

}  // namespace oblique::protocol
