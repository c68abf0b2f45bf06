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
  std::string keys = {};             ///< path of the server's key file; empty without keys
  bool insecure = false;             ///< if true, any peer may connect from any address
};

/// Which peers may connect to the ports.
enum class AccessMode {
  kLoopback,  ///< only peers on this machine; they need no keys
  kKeys,      ///< only peers with a listed key
  kInsecure,  ///< every peer
};
/// Returns "loopback", "keys" or "insecure".
std::string_view name_of(AccessMode mode);

/// Returns the numeric address to bind. "*" becomes "::", which includes IPv4, if the system has
/// IPv6. Throws solver::InputError for text that is not an address, for an address other than
/// loopback if there are neither keys nor `insecure`, and if there are both.
std::string address_to_bind(const AccessSettings& settings);

/// The current authorized keys.
class KeyList;

/// Where the server listens and which keys it admits. Logs to spdlog's default logger.
class AccessControl {
 public:
  /// Reads the server's key and the list of keys beside it. Throws the errors of `address_to_bind`,
  /// and solver::InputError for files that cannot be used.
  explicit AccessControl(const AccessSettings& settings);

  const std::string& address() const { return address_; }
  AccessMode mode() const { return mode_; }
  enum class PortRole { kClients, kWorkers };
  /// Returns the argument for `Network::listen`; nothing if the server has no keys.
  std::optional<PortSecurity> security(PortRole port) const;

  /// Reads the list of keys twice a second. Returns true if the authorized keys have changed. Must
  /// be called often; `now_ms` is the time of a monotonic clock. A list that cannot be read, for
  /// example during an edit, changes nothing. An empty list takes effect after four reads in a row.
  /// If every peer is admitted, logs a warning every ten minutes.
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
