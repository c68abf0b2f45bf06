#include "proto/address.h"

#include <netdb.h>
#include <sys/socket.h>

#include <charconv>
#include <string_view>
#include <system_error>

namespace oblique::protocol {
namespace {

constexpr std::string_view kScheme = "tcp://";

}  // namespace

std::string address_error(const std::string& url) {
  constexpr int kHighestPort = 65535;
  if (!url.starts_with(kScheme)) {
    return {};
  }
  int port = 0;
  const char* const begin = url.data() + url.rfind(':') + 1;
  const char* const end = url.data() + url.size();
  const auto [read, error] = std::from_chars(begin, end, port);
  if (error != std::errc() || read != end || port < 1 || port > kHighestPort) {
    return "its port must be a number from 1 to 65535";
  }
  const bool has_brackets = url[kScheme.size()] == '[' && begin[-2] == ']';
  return host_of(url).find(':') == std::string::npos || has_brackets
             ? ""
             : "an IPv6 address must be in brackets, as tcp://[::1]:7601";
}

std::string host_of(const std::string& url) {
  if (!url.starts_with(kScheme)) {
    return {};
  }
  const std::string host = url.substr(kScheme.size(), url.rfind(':') - kScheme.size());
  const bool is_bracketed = host.size() >= 2 && host.front() == '[' && host.back() == ']';
  return is_bracketed ? host.substr(1, host.size() - 2) : host;
}

Families families_of(const std::string& host) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), nullptr, &wanted, &found) != 0) {
    return {};
  }
  Families families;
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    families.has_v4 = families.has_v4 || address->ai_family == AF_INET;
    families.has_v6 = families.has_v6 || address->ai_family == AF_INET6;
  }
  freeaddrinfo(found);
  return families;
}

}  // namespace oblique::protocol
