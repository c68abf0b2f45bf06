#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "proto/keys/curve_key.h"
#include "server/network/curve/secret.h"
#include "server/network/curve/traffic.h"

namespace oblique::server {

/// What a peer's INITIATE says. That `client_key` is its key is proved by the vouch alone.
struct Claim {
  protocol::CurveKey client_key;
  std::string metadata;
};

/// The server's part of one CURVE handshake (rfc.zeromq.org 26): two commands of the peer, in
/// order, each once; what goes wrong ends it. All that it keeps between them is the key of the
/// cookie, which carries everything else, and so no command of one connection is worth anything on
/// another.
class CurveHandshake {
 public:
  /// `hello` and `initiate` are commands less their names. WELCOME's body less its name; nothing
  /// when HELLO cannot be opened with that key: it was made for another server's, or is forged.
  /// Costs two multiplications on the curve.
  std::optional<std::string> welcome(const protocol::SecretKey& server_key, std::string_view hello);
  /// What INITIATE claims; nothing when it does not belong to this handshake. Costs one
  /// multiplication.
  std::optional<Claim> claim(std::string_view initiate);
  /// Whether the peer holds the key that it claimed. Only after a claim, once; costs one
  /// multiplication.
  bool is_proved(const protocol::CurveKey& server_public_key);
  /// The keys of what follows. Only when it is proved.
  CurveTraffic traffic() const { return {shared_, heard_nonce_}; }

  static bool is_sound_hello(std::string_view hello);

 private:
  bool take_cookie(std::string_view cookie);

  Secret cookie_key_;
  std::uint64_t heard_nonce_ = 0;
  // From INITIATE on.
  Secret own_;                  // s', the server's for this connection
  Secret shared_;               // of C' and s'
  protocol::CurveKey peers_{};  // C', the client's for this connection
  protocol::CurveKey client_key_{};
  std::string vouch_;
};

}  // namespace oblique::server
