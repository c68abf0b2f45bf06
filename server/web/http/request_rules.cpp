#include "server/web/http/request_rules.h"

#include <algorithm>
#include <cstddef>
#include <string_view>

#include <arpa/inet.h>
#include <netinet/in.h>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/web/http/http_address.h"

namespace oblique::server {
namespace {

constexpr unsigned kBadRequest = 400;
constexpr unsigned kForbidden = 403;
constexpr unsigned kMethodNotAllowed = 405;
constexpr unsigned kContentTooLarge = 413;

bool is_numeric(const std::string& host) {
  in6_addr address{};
  return inet_pton(AF_INET, host.c_str(), &address) == 1 ||
         inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

bool is_own(const std::string& host, const OwnNames& own) {
  if (host == "localhost" || own.names.contains(host)) {
    return true;
  }
  return own.is_loopback ? is_loopback(host) : is_numeric(host);
}

std::optional<HttpRefusal> objection_to_hosts(const RequestHead& head, const OwnNames& own) {
  if (head.hosts.size() > 1) {
    return HttpRefusal{kBadRequest, "a request has one Host"};
  }
  for (const std::string& header : head.hosts) {
    const auto host = host_without_port(header);
    if (!host) {
      return HttpRefusal{kBadRequest, fmt::format("\"{}\" is no Host", protocol::excerpt(header))};
    }
    if (!is_own(*host, own)) {
      return HttpRefusal{
          kForbidden,
          fmt::format("this server is not called {}: ask for its address, or start it with "
                      "--http-name {}",
                      protocol::excerpt(*host), protocol::excerpt(*host))};
    }
  }
  return std::nullopt;
}

/// A page of this server and nobody else's. "null" is of a page without a site.
bool is_own_origin(const std::string& origin, const RequestHead& head) {
  constexpr std::string_view kScheme = "http://";
  return head.hosts.size() == 1 && origin == std::string(kScheme) + head.hosts.front();
}

/// The only one of these headers says this.
bool is(const std::vector<std::string>& headers, std::string_view word) {
  return headers.size() == 1 && headers.front() == word;
}

/// A link on a page of another site that opens a tab or takes one over, which is no page within
/// that site's.
bool is_followed_link(const RequestHead& head) {
  return head.may_be_linked_to && head.method == "GET" && head.origins.empty() &&
         (is(head.fetch_sites, "cross-site") || is(head.fetch_sites, "same-site")) &&
         is(head.fetch_modes, "navigate") && is(head.fetch_targets, "document");
}

std::optional<HttpRefusal> objection_to_change(const RequestHead& head) {
  if (head.origins.size() != 1 || std::any_of(head.fetch_sites.begin(), head.fetch_sites.end(),
                                              [](const auto& s) { return s != "same-origin"; })) {
    return HttpRefusal{kForbidden, "changes come from a page of this server only"};
  }
  if (head.has_body && (!head.body_bytes || *head.body_bytes > kMostBodyBytes)) {
    return HttpRefusal{
        kContentTooLarge,
        fmt::format("a change says its length, and has at most {} bytes", kMostBodyBytes)};
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> host_without_port(const std::string& header) {
  std::string_view rest = header;
  std::string_view host;
  if (rest.starts_with('[')) {
    const std::size_t end = rest.find(']');
    if (end == std::string_view::npos) {
      return std::nullopt;
    }
    host = rest.substr(1, end - 1);
    rest.remove_prefix(end + 1);
    if (!is_numeric(std::string(host)) || host.find(':') == std::string_view::npos) {
      return std::nullopt;
    }
  } else {
    host = rest.substr(0, rest.find(':'));
    rest.remove_prefix(host.size());
  }
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const bool has_port = rest.starts_with(':');
  rest.remove_prefix(has_port ? 1 : 0);
  constexpr std::size_t kLongestPort = 5;
  if (host.empty() || (!has_port && !rest.empty()) || rest.size() > kLongestPort ||
      !std::all_of(rest.begin(), rest.end(), is_digit)) {
    return std::nullopt;
  }
  std::string lower(host);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  const bool is_plain = std::all_of(lower.begin(), lower.end(), [&](char c) {
    return (c >= 'a' && c <= 'z') || is_digit(c) || c == '.' || c == '-' || c == '_' || c == ':';
  });
  return is_plain ? std::optional(lower) : std::nullopt;
}

std::optional<HttpRefusal> objection_to(const RequestHead& head, const OwnNames& own) {
  if (auto refusal = objection_to_hosts(head, own)) {
    return refusal;
  }
  if (head.has_zero_bytes) {
    return HttpRefusal{kBadRequest, "fields of a request have no zero bytes"};
  }
  const bool is_of_ours =
      std::all_of(head.origins.begin(), head.origins.end(),
                  [&](const std::string& origin) { return is_own_origin(origin, head); }) &&
      std::all_of(head.fetch_sites.begin(), head.fetch_sites.end(),
                  [](const std::string& site) { return site == "same-origin" || site == "none"; });
  if (!is_of_ours && !is_followed_link(head)) {
    return HttpRefusal{kForbidden, "pages of other sites get nothing from this server"};
  }
  if (head.method == "POST" && head.takes_changes) {
    return objection_to_change(head);
  }
  if (head.method != "GET" && head.method != "HEAD") {
    return HttpRefusal{kMethodNotAllowed, "only GET and HEAD are answered"};
  }
  if (head.has_body) {
    return HttpRefusal{kContentTooLarge, "a request here has no body"};
  }
  return std::nullopt;
}

}  // namespace oblique::server
