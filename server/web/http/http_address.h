#pragma once

#include <optional>
#include <string>

namespace oblique::server {

struct HttpAddress {
  std::string address = "127.0.0.1";  ///< numeric
  std::string port = "7602";          ///< "*": the system picks one
};

/// What ADDRESS:PORT or "off" says: 127.0.0.1:7602, [::1]:7602, localhost:7602; port 0 is one that
/// the system picks. Throws std::runtime_error that says what is allowed.
std::optional<HttpAddress> http_address_of(const std::string& text);

/// Whether only this machine reaches a numeric address.
bool is_loopback(const std::string& address);

}  // namespace oblique::server
