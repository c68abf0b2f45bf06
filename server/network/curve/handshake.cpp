#include "server/network/curve/handshake.h"

#include <cstring>

#include "server/network/curve/bytes.h"

namespace oblique::server {
namespace {

// Of HELLO, less its name.
constexpr std::size_t kPaddingAt = 2;
constexpr std::size_t kPeersKeyAt = 74;
constexpr std::size_t kHelloNonceAt = 106;
constexpr std::size_t kHelloBoxAt = 114;
constexpr std::size_t kHelloTextBytes = 64;
constexpr std::size_t kHelloBytes = kHelloBoxAt + kMacBytes + kHelloTextBytes;

constexpr std::size_t kCookieTextBytes = 2 * kKeyBytes;
constexpr std::size_t kCookieBytes = kRandomNonceBytes + kMacBytes + kCookieTextBytes;
constexpr std::size_t kWelcomeTextBytes = kKeyBytes + kCookieBytes;

// Of INITIATE, less its name, and of what its box holds.
constexpr std::size_t kInitiateBoxAt = kCookieBytes + kCountedNonceBytes;
constexpr std::size_t kVouchTextBytes = 2 * kKeyBytes;
constexpr std::size_t kVouchBytes = kRandomNonceBytes + kMacBytes + kVouchTextBytes;
constexpr std::size_t kFewestInitiateBytes = kInitiateBoxAt + kMacBytes + kKeyBytes + kVouchBytes;

std::string random_nonce() {
  std::string bytes(kRandomNonceBytes, '\0');
  randombytes_buf(bytes.data(), bytes.size());
  return bytes;
}

std::string_view text_of(const std::uint8_t* key) {
  return {reinterpret_cast<const char*>(key), kKeyBytes};
}

/// Text that is wiped when it is no longer needed.
template <std::size_t kBytes>
struct SecretText {
  std::array<std::uint8_t, kBytes> bytes{};
  ~SecretText() { sodium_memzero(bytes.data(), bytes.size()); }
};

}  // namespace

bool CurveHandshake::is_sound_hello(std::string_view hello) {
  return hello.size() == kHelloBytes && hello.starts_with(std::string_view("\1\0", 2)) &&
         sodium_is_zero(raw(hello.substr(kPaddingAt)), kPeersKeyAt - kPaddingAt) == 1;
}

std::optional<std::string> CurveHandshake::welcome(const protocol::SecretKey& server_key,
                                                   std::string_view hello) {
  const std::string_view peers_key = hello.substr(kPeersKeyAt, kKeyBytes);
  Secret shared;
  SecretText<kHelloTextBytes> zeros;
  const std::string_view number = hello.substr(kHelloNonceAt, kCountedNonceBytes);
  const CurveNonce hello_nonce = curve_nonce("CurveZMQHELLO---", number);
  if (crypto_box_beforenm(shared.data(), raw(peers_key), server_key.data()) != 0 ||
      crypto_box_open_easy_afternm(zeros.bytes.data(), raw(hello.substr(kHelloBoxAt)),
                                   kHelloBytes - kHelloBoxAt, hello_nonce.data(),
                                   shared.data()) != 0 ||
      sodium_is_zero(zeros.bytes.data(), zeros.bytes.size()) != 1) {
    return std::nullopt;
  }
  heard_nonce_ = number_of(number);

  protocol::CurveKey own_public;
  Secret own;
  crypto_box_keypair(own_public.data(), own.data());
  randombytes_buf(cookie_key_.data(), kKeyBytes);
  SecretText<kCookieTextBytes> cookie_text;
  std::memcpy(cookie_text.bytes.data(), peers_key.data(), kKeyBytes);
  std::memcpy(cookie_text.bytes.data() + kKeyBytes, own.data(), kKeyBytes);
  std::string welcome_text(text_of(own_public.data()));
  const std::string cookie_nonce = random_nonce();
  welcome_text += cookie_nonce;
  welcome_text.resize(kWelcomeTextBytes);
  crypto_secretbox_easy(raw(welcome_text.data() + kKeyBytes + kRandomNonceBytes),
                        cookie_text.bytes.data(), cookie_text.bytes.size(),
                        curve_nonce("COOKIE--", cookie_nonce).data(), cookie_key_.data());

  std::string welcome = random_nonce();
  const CurveNonce welcome_nonce = curve_nonce("WELCOME-", welcome);
  welcome.resize(kRandomNonceBytes + kMacBytes + kWelcomeTextBytes);
  crypto_box_easy_afternm(raw(welcome.data() + kRandomNonceBytes), raw(welcome_text),
                          welcome_text.size(), welcome_nonce.data(), shared.data());
  return welcome;
}

bool CurveHandshake::take_cookie(std::string_view cookie) {
  SecretText<kCookieTextBytes> text;
  const bool is_ours = crypto_secretbox_open_easy(
                           text.bytes.data(), raw(cookie.substr(kRandomNonceBytes)),
                           kCookieBytes - kRandomNonceBytes,
                           curve_nonce("COOKIE--", cookie.substr(0, kRandomNonceBytes)).data(),
                           cookie_key_.data()) == 0;
  cookie_key_.wipe();
  if (is_ours) {
    std::memcpy(peers_.data(), text.bytes.data(), kKeyBytes);
    std::memcpy(own_.data(), text.bytes.data() + kKeyBytes, kKeyBytes);
  }
  return is_ours;
}

std::optional<Claim> CurveHandshake::claim(std::string_view initiate) {
  if (initiate.size() < kFewestInitiateBytes || !take_cookie(initiate.substr(0, kCookieBytes))) {
    return std::nullopt;
  }
  const std::string_view number = initiate.substr(kCookieBytes, kCountedNonceBytes);
  const std::string_view box = initiate.substr(kInitiateBoxAt);
  std::string text(box.size() - kMacBytes, '\0');
  if (number_of(number) <= heard_nonce_ ||
      crypto_box_beforenm(shared_.data(), peers_.data(), own_.data()) != 0 ||
      crypto_box_open_easy_afternm(raw(text.data()), raw(box), box.size(),
                                   curve_nonce("CurveZMQINITIATE", number).data(),
                                   shared_.data()) != 0) {
    return std::nullopt;
  }
  heard_nonce_ = number_of(number);
  std::memcpy(client_key_.data(), text.data(), kKeyBytes);
  vouch_ = text.substr(kKeyBytes, kVouchBytes);
  return Claim{client_key_, text.substr(kKeyBytes + kVouchBytes)};
}

bool CurveHandshake::is_proved(const protocol::CurveKey& server_public_key) {
  SecretText<kVouchTextBytes> text;
  const std::string_view vouch = vouch_;
  const CurveNonce nonce = curve_nonce("VOUCH---", vouch.substr(0, kRandomNonceBytes));
  const bool opens = crypto_box_open_easy(text.bytes.data(), raw(vouch.substr(kRandomNonceBytes)),
                                          kVouchBytes - kRandomNonceBytes, nonce.data(),
                                          client_key_.data(), own_.data()) == 0;
  own_.wipe();
  return opens && sodium_memcmp(text.bytes.data(), peers_.data(), kKeyBytes) == 0 &&
         sodium_memcmp(text.bytes.data() + kKeyBytes, server_public_key.data(), kKeyBytes) == 0;
}

}  // namespace oblique::server
