#include "server/network/curve.h"

#include <cstring>
#include <utility>

namespace oblique::server {
namespace {

// Offsets and sizes of the parts of HELLO, without the command's name.
constexpr std::size_t kPaddingAt = 2;
constexpr std::size_t kPeersKeyAt = 74;
constexpr std::size_t kHelloCounterAt = 106;
constexpr std::size_t kHelloBoxAt = 114;
constexpr std::size_t kHelloTextBytes = 64;
constexpr std::size_t kHelloBytes = kHelloBoxAt + kMacBytes + kHelloTextBytes;

constexpr std::size_t kCookieTextBytes = 2 * kKeyBytes;
constexpr std::size_t kCookieBytes = kRandomNonceBytes + kMacBytes + kCookieTextBytes;
constexpr std::size_t kWelcomeTextBytes = kKeyBytes + kCookieBytes;

// Offsets and sizes of the parts of INITIATE (without its name) and of its encrypted text.
constexpr std::size_t kInitiateBoxAt = kCookieBytes + kCounterBytes;
constexpr std::size_t kVouchTextBytes = 2 * kKeyBytes;
constexpr std::size_t kVouchBytes = kRandomNonceBytes + kMacBytes + kVouchTextBytes;
constexpr std::size_t kPropertiesAt = kKeyBytes + kVouchBytes;
constexpr std::size_t kFewestInitiateBytes = kInitiateBoxAt + kMacBytes + kPropertiesAt;

constexpr std::string_view kMessageName = "\x07MESSAGE";
constexpr std::size_t kMessageHeaderBytes = kMessageName.size() + kCounterBytes;
static_assert(CurveSession::kAddedBytes == kMessageHeaderBytes + kMacBytes + 1);

std::string random_nonce() {
  std::string bytes(kRandomNonceBytes, '\0');
  randombytes_buf(bytes.data(), bytes.size());
  return bytes;
}

bool is_well_formed_hello(std::string_view hello) {
  return hello.size() == kHelloBytes && hello.starts_with(std::string_view("\1\0", 2)) &&
         sodium_is_zero(raw(hello.substr(kPaddingAt)), kPeersKeyAt - kPaddingAt) == 1;
}

}  // namespace

// ---- Handshake --------------------------------------------------------------------------------

CurveHandshake::Outcome CurveHandshake::take(std::string_view command, std::string_view data) {
  const Step step = std::exchange(next_, Step::kNone);
  if (step == Step::kHello && command == "HELLO") {
    return take_hello(data);
  }
  if (step == Step::kInitiate && command == "INITIATE") {
    return take_initiate(data);
  }
  return Refusal{RefusalCause::kFaulty, step == Step::kHello
                                            ? "its handshake does not begin with HELLO"
                                            : "it does not send INITIATE after WELCOME"};
}

CurveHandshake::Outcome CurveHandshake::take_hello(std::string_view hello) {
  if (!is_well_formed_hello(hello)) {
    return Refusal{RefusalCause::kFaulty, "its HELLO is not of CURVE 1.0"};
  }
  const std::string_view peers_key = hello.substr(kPeersKeyAt, kKeyBytes);
  const std::string_view counter = hello.substr(kHelloCounterAt, kCounterBytes);
  const CurveNonce nonce = curve_nonce("CurveZMQHELLO---", counter);
  Secret<kKeyBytes> hello_key;
  Secret<kHelloTextBytes> zeros;
  if (crypto_box_beforenm(hello_key.data(), raw(peers_key), security_.server.secret_key.data()) !=
          0 ||
      crypto_box_open_easy_afternm(zeros.data(), raw(hello.substr(kHelloBoxAt)),
                                   kHelloBytes - kHelloBoxAt, nonce.data(),
                                   hello_key.data()) != 0 ||
      sodium_is_zero(zeros.data(), kHelloTextBytes) != 1) {
    return Refusal{RefusalCause::kWrongServerKey, "it uses another public key of the server"};
  }
  hello_counter_ = number_of(counter);
  next_ = Step::kInitiate;
  return welcome(peers_key, hello_key);
}

/// Returns the data of WELCOME: a new public key of the server for this connection, and the cookie.
std::string CurveHandshake::welcome(std::string_view peers_key,
                                    const Secret<kKeyBytes>& hello_key) {
  protocol::CurveKey own_public;
  Secret<kCookieTextBytes> cookie_text;
  std::memcpy(cookie_text.data(), peers_key.data(), kKeyBytes);
  crypto_box_keypair(own_public.data(), cookie_text.data() + kKeyBytes);
  randombytes_buf(cookie_key_.data(), kKeyBytes);
  const std::string cookie_nonce = random_nonce();
  std::string text(own_public.begin(), own_public.end());
  text += cookie_nonce;
  text.resize(kWelcomeTextBytes);
  crypto_secretbox_easy(raw(text.data() + kKeyBytes + kRandomNonceBytes), cookie_text.data(),
                        kCookieTextBytes, curve_nonce("COOKIE--", cookie_nonce).data(),
                        cookie_key_.data());

  std::string welcome = random_nonce();
  const CurveNonce nonce = curve_nonce("WELCOME-", welcome);
  welcome.resize(kRandomNonceBytes + kMacBytes + kWelcomeTextBytes);
  crypto_box_easy_afternm(raw(welcome.data() + kRandomNonceBytes), raw(text), text.size(),
                          nonce.data(), hello_key.data());
  return welcome;
}

CurveHandshake::Outcome CurveHandshake::take_initiate(std::string_view initiate) {
  const Refusal foreign{RefusalCause::kFaulty, "its INITIATE does not belong to its HELLO"};
  if (initiate.size() < kFewestInitiateBytes) {
    return foreign;
  }
  Secret<kCookieTextBytes> cookie;
  const bool is_own_cookie =
      crypto_secretbox_open_easy(
          cookie.data(), raw(initiate.substr(kRandomNonceBytes)), kCookieBytes - kRandomNonceBytes,
          curve_nonce("COOKIE--", initiate.substr(0, kRandomNonceBytes)).data(),
          cookie_key_.data()) == 0;
  cookie_key_.wipe();
  const std::uint8_t* const short_term_key = cookie.data();
  const std::uint8_t* const own_short_term_secret = cookie.data() + kKeyBytes;
  const std::string_view counter = initiate.substr(kCookieBytes, kCounterBytes);
  const std::string_view box = initiate.substr(kInitiateBoxAt);
  std::string text(box.size() - kMacBytes, '\0');
  Secret<kKeyBytes> shared;
  if (!is_own_cookie || number_of(counter) <= hello_counter_ ||
      crypto_box_beforenm(shared.data(), short_term_key, own_short_term_secret) != 0 ||
      crypto_box_open_easy_afternm(raw(text.data()), raw(box), box.size(),
                                   curve_nonce("CurveZMQINITIATE", counter).data(),
                                   shared.data()) != 0) {
    return foreign;
  }
  std::memcpy(key_.data(), text.data(), kKeyBytes);
  // Checks the vouch before the list of keys, so that a forged INITIATE does not reveal which keys
  // are listed.
  if (!is_vouched(std::string_view(text).substr(kKeyBytes, kVouchBytes), key_, short_term_key,
                  own_short_term_secret)) {
    return Refusal{RefusalCause::kFaulty, "it does not hold the secret half of its key"};
  }
  AuthResult result = security_.authenticate(key_);
  if (auto* const refusal = std::get_if<Refusal>(&result)) {
    return std::move(*refusal);
  }
  identity_ = std::get<std::shared_ptr<const KeyIdentity>>(std::move(result));
  session_.emplace(shared, number_of(counter));
  return text.substr(kPropertiesAt);
}

/// Returns whether the vouch proves that the peer holds the secret half of `client_key` in this
/// handshake with this server.
bool CurveHandshake::is_vouched(std::string_view vouch, const protocol::CurveKey& client_key,
                                const std::uint8_t* short_term_key,
                                const std::uint8_t* own_short_term_secret) const {
  Secret<kVouchTextBytes> text;
  const CurveNonce nonce = curve_nonce("VOUCH---", vouch.substr(0, kRandomNonceBytes));
  return crypto_box_open_easy(text.data(), raw(vouch.substr(kRandomNonceBytes)),
                              kVouchBytes - kRandomNonceBytes, nonce.data(), client_key.data(),
                              own_short_term_secret) == 0 &&
         sodium_memcmp(text.data(), short_term_key, kKeyBytes) == 0 &&
         sodium_memcmp(text.data() + kKeyBytes, security_.server.public_key.data(), kKeyBytes) == 0;
}

std::string_view error_code(RefusalCause cause) {
  constexpr std::array<std::string_view, kRefusalCauses> kCodes{"400", "400", "400", "500",
                                                                "500", "300", "300", "500"};
  return kCodes.at(static_cast<std::size_t>(cause));
}

// ---- Messages ---------------------------------------------------------------------------------

std::string CurveSession::ready(std::string_view properties) {
  std::string command = big_endian_of(++sent_counter_);
  const CurveNonce nonce = curve_nonce("CurveZMQREADY---", command);
  command.resize(kCounterBytes + kMacBytes + properties.size());
  crypto_box_easy_afternm(raw(command.data() + kCounterBytes), raw(properties), properties.size(),
                          nonce.data(), key_.data());
  return command;
}

void CurveSession::seal(std::string_view body, std::string& out) {
  const std::string counter = big_endian_of(++sent_counter_);
  const CurveNonce nonce = curve_nonce("CurveZMQMESSAGES", counter);
  out += kMessageName;
  out += counter;
  const std::size_t mac_at = out.size();
  out.append(kMacBytes + 1, '\0');  // flags 0: a single frame, not a command
  out += body;
  std::uint8_t* const mac = raw(out.data() + mac_at);
  crypto_box_detached_afternm(mac + kMacBytes, mac, mac + kMacBytes, body.size() + 1, nonce.data(),
                              key_.data());
}

std::optional<std::string> CurveSession::open(std::string_view message) {
  if (message.size() < kAddedBytes || !message.starts_with(kMessageName)) {
    return std::nullopt;
  }
  const std::string_view counter = message.substr(kMessageName.size(), kCounterBytes);
  if (number_of(counter) <= received_counter_) {
    return std::nullopt;
  }
  const CurveNonce nonce = curve_nonce("CurveZMQMESSAGEC", counter);
  const std::uint8_t* const mac = raw(message.substr(kMessageHeaderBytes));
  std::string text(message.substr(kMessageHeaderBytes + kMacBytes));
  if (crypto_box_open_detached_afternm(raw(text.data()), raw(text), mac, text.size(), nonce.data(),
                                       key_.data()) != 0) {
    return std::nullopt;
  }
  received_counter_ = number_of(counter);
  if (text.front() != '\0') {
    return std::nullopt;
  }
  text.erase(0, 1);
  return text;
}

}  // namespace oblique::server
