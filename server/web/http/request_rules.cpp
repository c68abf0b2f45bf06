#include "server/web/http/request_rules.h"

#include <algorithm>
#include <cstddef>
#include <regex>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/network/listener.h"

namespace oblique::server {
namespace {

bool is_own(const std::string& host, const OwnNames& own) {
  return host == "localhost" || own.names.contains(host) ||
         (own.is_loopback ? is_loopback(host).value_or(false) : is_loopback(host).has_value());
}

bool is(const HttpRequest& request, const std::string& header, std::string_view value) {
  const auto values = request.all(header);
  return values.size() == 1 && values.front() == value;
}

bool all_are(const std::vector<std::string>& values, const std::set<std::string>& allowed) {
  return std::all_of(values.begin(), values.end(),
                     [&](const std::string& value) { return allowed.contains(value); });
}

/// Returns whether the request follows a link on a page of another site. The link must have no
/// fields; otherwise it could contain a token and log in the browser.
bool is_followed_link(const HttpRequest& request) {
  return request.path == "/" && request.fields.empty() && request.method == "GET" &&
         request.all("origin").empty() &&
         (is(request, "sec-fetch-site", "cross-site") ||
          is(request, "sec-fetch-site", "same-site")) &&
         is(request, "sec-fetch-mode", "navigate") && is(request, "sec-fetch-dest", "document");
}

}  // namespace

std::string host_without_port(const std::string& header) {
  constexpr std::size_t kLongest = 300;  // a host name has at most 253 characters
  static const std::regex kHost(
      R"((?:\[([0-9a-f.]*:[0-9a-f:.]*)\]|([a-z0-9._-]+))(?::[0-9]{0,5})?)", std::regex::icase);
  std::smatch found;
  if (header.size() > kLongest || !std::regex_match(header, found, kHost)) {
    return {};
  }
  std::string host = found[1].str() + found[2].str();
  std::transform(host.begin(), host.end(), host.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return host;
}

std::optional<HttpAddress> parse_http_address(const std::string& text) {
  if (text == "off") {
    return std::nullopt;
  }
  const std::string host = host_without_port(text);
  const std::string address = host == "localhost" ? "127.0.0.1" : host;
  const auto port = read_number<std::uint16_t>(text.substr(text.rfind(':') + 1));
  if (!port || !is_loopback(address)) {
    throw std::runtime_error(
        fmt::format("--http {} is not ADDRESS:PORT, as 127.0.0.1:7602 or [::1]:7602, with a port "
                    "from 0 to 65535 "
                    "(0: chosen by the system), or \"off\"",
                    protocol::visible(text)));
  }
  return HttpAddress{address, *port == 0 ? "*" : std::to_string(*port)};
}

std::optional<HttpAnswer> refuse(const HttpRequest& request, const OwnNames& own) {
  const auto hosts = request.all("host");
  const auto origins = request.all("origin");
  const auto sites = request.all("sec-fetch-site");
  if (hosts.size() > 1) {
    return text_answer(MHD_HTTP_BAD_REQUEST, "a request must have one Host header");
  }
  if (!hosts.empty() && !is_own(host_without_port(hosts.front()), own)) {
    const std::string name = protocol::excerpt(hosts.front());
    return text_answer(
        MHD_HTTP_FORBIDDEN,
        fmt::format("\"{}\" is not a name of this server: use its address, or start it "
                    "with --http-name and this name without the port",
                    name));
  }
  if (request.has_zero_bytes) {
    return text_answer(MHD_HTTP_BAD_REQUEST, "fields of a request must not contain zero bytes");
  }
  // Proxies name the browser's host in X-Forwarded-Host, which a page of another site cannot send.
  const std::string forwarded = request.header("x-forwarded-host");
  const std::set<std::string> own_origins{"http://" + request.header("host"), "http://" + forwarded,
                                          "https://" + forwarded};
  const bool is_from_here =
      all_are(origins, own_origins) && all_are(sites, {"same-origin", "none"});
  if (!is_from_here && !is_followed_link(request)) {
    return text_answer(MHD_HTTP_FORBIDDEN, "requests from pages of other sites are refused");
  }
  if (request.method == "POST") {
    if (origins.size() != 1 || !all_are(sites, {"same-origin"})) {
      return text_answer(MHD_HTTP_FORBIDDEN, "only a page of this server can make changes");
    }
  } else if (request.method != "GET" && request.method != "HEAD") {
    return text_answer(MHD_HTTP_METHOD_NOT_ALLOWED, "only GET, HEAD and POST are allowed");
  }
  const std::string length = request.header("content-length");
  if (request.headers.contains("transfer-encoding") ||
      (!length.empty() &&
       read_number<std::uint64_t>(length).value_or(kMaxBodyBytes + 1) > kMaxBodyBytes)) {
    return text_answer(
        MHD_HTTP_CONTENT_TOO_LARGE,
        fmt::format("a body must state its length, at most {} bytes", kMaxBodyBytes));
  }
  return std::nullopt;
}

}  // namespace oblique::server
