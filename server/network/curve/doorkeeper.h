#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "proto/keys/curve_key.h"

namespace oblique::server {

/// Why a peer does not get in, or must leave.
enum class RefusalCause : std::size_t {
  kUnknownKey,      ///< its key is on no list
  kRevokedKey,      ///< its key was on the list
  kOtherRole,       ///< its key is for another port
  kWrongServerKey,  ///< it knows another key of the server than the one that the server has
  kOtherMechanism,  ///< it has no key where one is needed, or one where none is
  kBound,           ///< it, or its key, has as much as it may have
  kTooSlow,         ///< it does not finish its handshake
  kFaulty,          ///< it does not speak the protocol
};
inline constexpr std::size_t kRefusalCauses = 8;

/// As "unknown key": for logs, tables and labels.
std::string_view name_of(RefusalCause cause);

struct Refusal {
  RefusalCause cause = RefusalCause::kFaulty;
  std::string reason;  ///< for people, as "its key is not authorized"
};

/// Whose key a peer holds, as it has proved.
struct KeyHolder {
  std::string name;
  protocol::Role role;

  bool operator==(const KeyHolder&) const = default;
};

using Verdict = std::variant<std::shared_ptr<const KeyHolder>, Refusal>;

/// Knows who may come in at a port.
class Doorkeeper {
 public:
  virtual ~Doorkeeper() = default;
  /// Whose key that is, or why it is not admitted. Only called for a key that the peer has proved
  /// to hold. Called often, so it must be quick.
  virtual Verdict judge(const protocol::CurveKey& public_key) const = 0;
};

/// What guards a port: the server's keys, and who knows whose are admitted.
struct PortGuard {
  PortGuard(const protocol::KeyPair& server, std::shared_ptr<const Doorkeeper> keeper);

  protocol::SecretKey server_secret;
  protocol::CurveKey server_public;
  std::shared_ptr<const Doorkeeper> doorkeeper;
};

}  // namespace oblique::server
