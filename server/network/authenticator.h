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

/// The reason why a peer is refused or disconnected.
enum class RefusalCause : std::size_t {
  kUnknownKey,      ///< the peer's key is not in the list of keys
  kRevokedKey,      ///< the peer's key was removed from the list while it was connected
  kOtherRole,       ///< the peer's key is for the other port
  kWrongServerKey,  ///< the peer expects another public key of the server
  kOtherMechanism,  ///< only one of peer and server has a key
  kBound,           ///< too many connections or handshakes
  kTooSlow,         ///< the peer does not finish its handshake in time
  kFaulty,          ///< the peer violates the protocol
};
inline constexpr std::size_t kRefusalCauses = 8;

/// Returns a name such as "unknown key" for logs, tables and labels.
inline std::string_view name_of(RefusalCause cause) {
  constexpr std::array<std::string_view, kRefusalCauses> kNames{
      "unknown key",      "revoked key",     "key of another role",
      "wrong server key", "other mechanism", "limit reached",
      "too slow",         "faulty"};
  return kNames.at(static_cast<std::size_t>(cause));
}

struct Refusal {
  RefusalCause cause = RefusalCause::kFaulty;
  std::string reason;  ///< a sentence part, as "its key is not authorized"
};

/// Name and role of a listed key.
struct KeyIdentity {
  std::string name;
  protocol::Role role;

  bool operator==(const KeyIdentity&) const = default;
};

/// Outcome of sending a message to a peer.
enum class Delivery {
  kSent,  ///< the message was sent or queued
  kBusy,  ///< sent or queued; the peer leaves much unread and should get no more work now
  kGone,  ///< the peer has disconnected
};

using AuthResult = std::variant<std::shared_ptr<const KeyIdentity>, Refusal>;

/// Decides whether a peer with this public key may connect. It is called on the event loop, after
/// the peer has proved that it holds the secret key.
using Authenticate = std::function<AuthResult(const protocol::CurveKey& public_key)>;

/// Settings of a port with keys.
struct PortSecurity {
  protocol::KeyPair server;
  Authenticate authenticate;
};

}  // namespace oblique::server
