#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace oblique::server {

/// What a request says of itself before it has an answer.
struct RequestHead {
  std::string method;
  bool has_body = false;
  std::vector<std::string> hosts;        ///< every Host header
  std::vector<std::string> origins;      ///< every Origin header
  std::vector<std::string> fetch_sites;  ///< every Sec-Fetch-Site header
  bool has_zero_bytes = false;           ///< in a field: what follows one is easily overlooked
  bool takes_changes = false;            ///< something can be changed at its path, by POST
  std::optional<std::uint64_t> body_bytes = {};  ///< as Content-Length says
  bool may_be_linked_to = false;                ///< what is there holds nothing and changes nothing
  std::vector<std::string> fetch_modes = {};    ///< every Sec-Fetch-Mode header
  std::vector<std::string> fetch_targets = {};  ///< every Sec-Fetch-Dest header
};

/// By what a server may be called in a request. A page of a stranger, opened in a browser on this
/// machine or near it, can make its own name mean our address (DNS rebinding), and would then read
/// us as if we were its own site; but it cannot make the browser ask for a name that is not its.
struct OwnNames {
  /// Only this machine reaches the server: addresses of other machines are none of its names.
  bool is_loopback = true;
  /// Beside numeric addresses and localhost; in lower case.
  std::set<std::string> names;
};

struct HttpRefusal {
  unsigned status;
  std::string sentence;
};

/// A change has so many bytes at most.
inline constexpr std::uint64_t kMostBodyBytes = std::uint64_t{256} * 1024;

/// Why the request gets no answer; nothing: it gets one. What changes something must come from a
/// page of this server, which says so by `Origin`; who else asks, as a program, has the port of the
/// clients. Of what comes from pages of other sites only a link that somebody follows is answered,
/// where the head `may_be_linked_to`.
std::optional<HttpRefusal> objection_to(const RequestHead& head, const OwnNames& own);

/// The host of a Host header, in lower case and without port and brackets: "127.0.0.1" of
/// "127.0.0.1:7602", "::1" of "[::1]:7602". Nothing when it is malformed.
std::optional<std::string> host_without_port(const std::string& header);

}  // namespace oblique::server
