#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/network/authenticator.h"

namespace oblique::server {

struct AccessSettings {
  std::string listen = "127.0.0.1";  ///< numeric address, "localhost", or "*": all addresses
  std::string keys = {};             ///< the server's key file; empty: none
  bool insecure = false;             ///< admits every peer at any address
};

/// Who may connect to the ports.
enum class AccessMode {
  kLoopback,  ///< only peers on this machine, without keys
  kKeys,      ///< only peers with a listed key
  kInsecure,  ///< every peer
};
/// "loopback", "keys" or "insecure".
std::string_view name_of(AccessMode mode);

/// The numeric address to bind; "*" becomes "::", which includes IPv4, if the system has IPv6.
/// Throws solver::InputError for text that is not an address, for an address other than loopback
/// without keys and `insecure`, and for keys together with `insecure`.
std::string address_to_bind(const AccessSettings& settings);

/// The current authorized keys.
class KeyList;

/// Where the server listens and which keys it admits. Logs to spdlog's default logger.
class AccessControl {
 public:
  /// Reads the server's key and the list beside it. Throws as `address_to_bind`, and
  /// solver::InputError for files that cannot be used.
  explicit AccessControl(const AccessSettings& settings);

  const std::string& address() const { return address_; }
  AccessMode mode() const { return mode_; }
  enum class PortRole { kClients, kWorkers };
  /// For `Network::listen`. Nothing if the server has no keys.
  std::optional<PortSecurity> security(PortRole port) const;

  /// To be called often with milliseconds of a monotonic clock. Reads the list of keys twice a
  /// second; true if the admitted keys have changed. A list that cannot be read, as during an edit,
  /// changes nothing; an empty one applies from its fourth read. Without any protection logs a
  /// warning every ten minutes.
  bool refresh(std::int64_t now_ms);

 private:
  std::string address_;
  AccessMode mode_;
  protocol::KeyPair server_;
  std::shared_ptr<KeyList> list_;
  std::int64_t next_refresh_ms_ = INT64_MIN;
  std::int64_t next_warning_ms_ = INT64_MIN;
};

}  // namespace oblique::server
