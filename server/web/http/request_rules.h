#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "server/web/http/http_message.h"

// Where the server listens, and which requests it refuses before it looks at what they ask for.
namespace oblique::server {

struct HttpAddress {
  std::string address = "127.0.0.1";  ///< numeric
  std::string port = "7602";          ///< "*": the system picks one
};

/// Parses ADDRESS:PORT, as 127.0.0.1:7602, [::1]:7602 or localhost:7602, or "off"; port 0: the
/// system picks one. Throws std::runtime_error that says what is allowed.
std::optional<HttpAddress> parse_http_address(const std::string& text);

/// The host of a Host header in lower case, without port and brackets; empty if it is malformed.
std::string host_without_port(const std::string& header);

/// Names of this server in a Host header. A hostile page in a browser on this machine can make its
/// own name resolve to our address (DNS rebinding), and then read us as its own site; it cannot
/// make the browser send another name than its own.
struct OwnNames {
  /// Addresses of other machines are no names of a server that listens on loopback.
  bool is_loopback = true;
  /// Besides numeric addresses and localhost; in lower case.
  std::set<std::string> names;
};

inline constexpr std::uint64_t kMaxBodyBytes = std::uint64_t{256} * 1024;

/// Why a request is refused; none: it is not. A POST must come from a page of this server, which
/// its `Origin` says; programs use the clients' port. Of requests from pages of other sites only a
/// followed link to the page itself, without any field, is answered.
std::optional<HttpAnswer> refuse(const HttpRequest& request, const OwnNames& own);

}  // namespace oblique::server
