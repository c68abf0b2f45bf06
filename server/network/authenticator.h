#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "proto/keys/key_file.h"

namespace oblique::server {

/// Why a peer is not admitted, or is disconnected.
enum class RefusalCause : std::size_t {
  kUnknownKey,      ///< its key is not listed
  kRevokedKey,      ///< its key was removed from the list while it was connected
  kOtherRole,       ///< its key is for the other port
  kWrongServerKey,  ///< it uses a public key that is not the server's
  kOtherMechanism,  ///< it has no key where one is needed, or one where none is
  kBound,           ///< there are too many connections or handshakes
  kTooSlow,         ///< it does not finish its handshake
  kFaulty,          ///< it breaks the protocol
};
inline constexpr std::size_t kRefusalCauses = 8;

/// As "unknown key": for logs, tables and labels.
inline std::string_view name_of(RefusalCause cause) {
  constexpr std::array<std::string_view, kRefusalCauses> kNames{
      "unknown key",      "revoked key",     "key of another role",
      "wrong server key", "other mechanism", "more than may be",
      "too slow",         "faulty"};
  return kNames.at(static_cast<std::size_t>(cause));
}

struct Refusal {
  RefusalCause cause = RefusalCause::kFaulty;
  std::string reason;  ///< for people, as "its key is not authorized"
};

/// The name and role with which a public key is listed.
struct KeyIdentity {
  std::string name;
  protocol::Role role;

  bool operator==(const KeyIdentity&) const = default;
};

/// What became of a message to a peer.
enum class Delivery {
  kSent,  ///< it is on its way
  kBusy,  ///< the same, but so much waits to go out that the peer should get no further work yet
  kGone,  ///< there is no such peer any more
};

using AuthResult = std::variant<std::shared_ptr<const KeyIdentity>, Refusal>;

/// Decides whether a key is admitted. Called on the event loop, and only for a key that the peer
/// has proved to hold.
using Authenticate = std::function<AuthResult(const protocol::CurveKey& public_key)>;

/// What a port with keys needs.
struct PortSecurity {
  protocol::KeyPair server;
  Authenticate authenticate;
};

}  // namespace oblique::server
