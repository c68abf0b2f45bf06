#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "server/network/curve.h"
#include "tests/server/network/raw_peer.h"

namespace oblique::server {

/// Admits listed keys. Copies share one list, so that a key added to one copy is admitted by all.
class ListAuthenticator {
 public:
  void add(const protocol::CurveKey& key, const std::string& name) {
    (*keys_)[key] = std::make_shared<const KeyIdentity>(KeyIdentity{name, protocol::Role::kWorker});
  }
  void revoke(const protocol::CurveKey& key) { keys_->erase(key); }

  AuthResult operator()(const protocol::CurveKey& key) const {
    const auto found = keys_->find(key);
    if (found == keys_->end()) {
      return Refusal{RefusalCause::kUnknownKey, "its key is not authorized"};
    }
    return found->second;
  }

 private:
  using Keys = std::map<protocol::CurveKey, std::shared_ptr<const KeyIdentity>>;
  std::shared_ptr<Keys> keys_ = std::make_shared<Keys>();
};

inline std::string text_of_key(const protocol::CurveKey& key) {
  return {key.begin(), key.end()};
}

inline std::string curve_greeting() {
  std::string bytes = zmtp_greeting();
  return bytes.replace(12, 5, "CURVE");
}

/// Implements the client's side of CURVE (rfc.zeromq.org 26). Tests change the fields to send
/// messages that no library sends.
struct CurveClient {
  CurveClient(const protocol::KeyPair& own_keys, const protocol::CurveKey& servers_key)
      : own(own_keys), server(servers_key) {}

  protocol::KeyPair own;
  protocol::CurveKey server;
  protocol::KeyPair short_term = protocol::generate_key_pair();  // C', c'
  std::uint64_t nonce = 1;                                       // counter of the next command
  std::string properties = zmtp_properties("DEALER");

  // Set by WELCOME.
  protocol::CurveKey server_short_term{};  // S'
  std::string cookie;

  // Tests set these fields to forge a wrong vouch.
  std::optional<protocol::CurveKey> vouched_short_term = {};
  std::optional<protocol::CurveKey> vouched_server = {};
  std::optional<protocol::SecretKey> vouching_secret = {};

  std::string next_number() { return big_endian_of(nonce++); }

  static std::string box(std::string_view text, const CurveNonce& nonce_bytes,
                         const protocol::CurveKey& to, const protocol::SecretKey& from) {
    std::string sealed(kMacBytes + text.size(), '\0');
    if (crypto_box_easy(raw(sealed.data()), raw(text), text.size(), nonce_bytes.data(), to.data(),
                        from.data()) != 0) {
      throw std::runtime_error("a message cannot be encrypted with this key");
    }
    return sealed;
  }
  static std::optional<std::string> opened(std::string_view sealed, const CurveNonce& nonce_bytes,
                                           const protocol::CurveKey& from,
                                           const protocol::SecretKey& to) {
    std::string text(sealed.size() - kMacBytes, '\0');
    if (crypto_box_open_easy(raw(text.data()), raw(sealed), sealed.size(), nonce_bytes.data(),
                             from.data(), to.data()) != 0) {
      return std::nullopt;
    }
    return text;
  }

  /// Returns the data of the command HELLO.
  std::string hello() {
    std::string data("\1\0", 2);
    data.append(72, '\0');
    data += text_of_key(short_term.public_key);
    const std::string number = next_number();
    data += number;
    return data += box(std::string(64, '\0'), curve_nonce("CurveZMQHELLO---", number), server,
                       short_term.secret_key);
  }
  /// Decrypts the data of WELCOME and stores the key and the cookie that it contains. Returns false
  /// if the data is not encrypted for this client.
  bool take_welcome(std::string_view data) {
    const auto text = opened(data.substr(16), curve_nonce("WELCOME-", data.substr(0, 16)), server,
                             short_term.secret_key);
    if (!text || text->size() != 128) {
      return false;
    }
    std::copy_n(text->begin(), server_short_term.size(), server_short_term.begin());
    cookie = text->substr(32);
    return true;
  }
  /// Returns the data of the command INITIATE.
  std::string initiate() {
    const std::string vouch_nonce(16, 'v');
    std::string text = text_of_key(own.public_key) + vouch_nonce;
    text += box(text_of_key(vouched_short_term.value_or(short_term.public_key)) +
                    text_of_key(vouched_server.value_or(server)),
                curve_nonce("VOUCH---", vouch_nonce), server_short_term,
                vouching_secret.value_or(own.secret_key));
    text += properties;
    const std::string number = next_number();
    return cookie + number +
           box(text, curve_nonce("CurveZMQINITIATE", number), server_short_term,
               short_term.secret_key);
  }
  /// Returns an encrypted message. Flags: 1 if more frames follow, 2 for a command.
  std::string sealed(std::string_view body, unsigned flags = 0) {
    const std::string number = next_number();
    const std::string text = static_cast<char>(flags) + std::string(body);
    return zmtp_frame("\x07MESSAGE" + number +
                      box(text, curve_nonce("CurveZMQMESSAGEC", number), server_short_term,
                          short_term.secret_key));
  }
  /// Returns flags and body of a MESSAGE, or nothing if it is not encrypted for this client.
  std::optional<std::string> opened_message(std::string_view message) const {
    return opened(message.substr(16), curve_nonce("CurveZMQMESSAGES", message.substr(8, 8)),
                  server_short_term, short_term.secret_key);
  }
};

}  // namespace oblique::server
