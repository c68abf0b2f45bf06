#include "server/web/http/http_address.h"

#include <charconv>
#include <cstdint>
#include <stdexcept>
#include <system_error>

#include <arpa/inet.h>
#include <netinet/in.h>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::server {
namespace {

bool is_v4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

bool is_v6(const std::string& text) {
  in6_addr address{};
  return inet_pton(AF_INET6, text.c_str(), &address) == 1;
}

/// The port as the network takes it; nothing for what is none.
std::optional<std::string> port_of(const std::string& text) {
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, port);
  if (error != std::errc() || rest != end) {
    return std::nullopt;
  }
  return port == 0 ? "*" : std::to_string(port);
}

}  // namespace

std::optional<HttpAddress> http_address_of(const std::string& text) {
  if (text == "off") {
    return std::nullopt;
  }
  const std::size_t colon = text.rfind(':');
  if (colon != std::string::npos) {
    const std::string before = text.substr(0, colon);
    const auto port = port_of(text.substr(colon + 1));
    const bool has_brackets = before.size() > 2 && before.front() == '[' && before.back() == ']';
    const std::string inner = has_brackets ? before.substr(1, before.size() - 2) : before;
    if (port && before == "localhost") {
      return HttpAddress{"127.0.0.1", *port};
    }
    if (port && (has_brackets ? is_v6(inner) : is_v4(before))) {
      return HttpAddress{inner, *port};
    }
  }
  throw std::runtime_error(
      fmt::format("--http {} is no ADDRESS:PORT, as 127.0.0.1:7602 or [::1]:7602 with a port from "
                  "0 to 65535 (0: the system picks one), and not \"off\"",
                  protocol::visible(text)));
}

bool is_loopback(const std::string& address) {
  in_addr v4{};
  in6_addr v6{};
  return (inet_pton(AF_INET, address.c_str(), &v4) == 1 && (ntohl(v4.s_addr) >> 24U) == 127) ||
         (inet_pton(AF_INET6, address.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6));
}

}  // namespace oblique::server
