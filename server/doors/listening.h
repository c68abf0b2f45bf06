#pragma once

#include <string>
#include <string_view>

namespace oblique::server {

struct DoorSettings {
  std::string listen = "127.0.0.1";  ///< numeric address, "localhost", or "*": all addresses
  std::string keys = {};             ///< the server's key file; empty: none
  bool insecure = false;             ///< lets in whoever reaches the ports, from anywhere
};

/// What stands between the ports and strangers.
enum class Access {
  kLoopback,  ///< only this machine reaches them; no keys
  kKeys,      ///< only listed keys are let in
  kInsecure,  ///< nothing
};
/// "loopback", "keys" or "insecure".
std::string_view name_of(Access access);
Access access_of(const DoorSettings& settings);

/// The numeric address to bind; "::" for "*" where the system has IPv6, which takes IPv4 too.
/// Throws solver::InputError, saying what is allowed, for text that is no address, for one beyond
/// loopback without keys and `insecure`, and for keys and `insecure` together.
std::string address_to_bind(const DoorSettings& settings);

}  // namespace oblique::server
