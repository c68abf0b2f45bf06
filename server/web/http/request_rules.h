#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "server/web/http/http_message.h"

// Address of the HTTP server, and rules that it applies to requests before their content.
namespace oblique::server {

struct HttpAddress {
  std::string address = "127.0.0.1";  ///< a numeric address
  std::string port = "7602";          ///< "*": chosen by the system
};

/// Parses ADDRESS:PORT, such as 127.0.0.1:7602, [::1]:7602 or localhost:7602. With port 0 the
/// system chooses the port. Returns nothing for "off". Throws std::runtime_error with what is
/// allowed.
std::optional<HttpAddress> parse_http_address(const std::string& text);

/// Returns the host in a Host header in lower case, without port and brackets; empty if malformed.
std::string host_without_port(const std::string& header);

/// Names of this server that a Host header may contain. A malicious page can make its own name
/// resolve to our address (DNS rebinding) and then read our answers as its own site, but it cannot
/// change the name that the browser sends.
struct OwnNames {
  /// If true, the server listens on loopback, and addresses other than loopback are not its names.
  bool is_loopback = true;
  /// Further allowed names, besides numeric addresses and localhost; in lower case.
  std::set<std::string> names;
};

inline constexpr std::uint64_t kMaxBodyBytes = std::uint64_t{256} * 1024;

/// Returns the answer that refuses a request; nothing if the request is allowed. Refuses a POST
/// unless its `Origin` is this server; programs use the port for clients instead. Refuses requests
/// from pages of other sites, except a link to the page without fields.
std::optional<HttpAnswer> refuse(const HttpRequest& request, const OwnNames& own);

}  // namespace oblique::server
