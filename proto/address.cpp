#include "proto/address.h"

#include <netdb.h>

#include <charconv>
#include <string_view>
#include <system_error>
#include <thread>

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

bool is_name(std::string_view host) {
  return host.find(':') == std::string_view::npos &&
         host.find_first_not_of("0123456789.") != std::string_view::npos;
}

AddressLookup::AddressLookup(const std::string& url) : host_(host_of(url)) {
  if (!is_name(host_)) {
    return;
  }
  std::thread([host = host_, found_none = found_none_] {
    addrinfo* found = nullptr;
    if (getaddrinfo(host.c_str(), nullptr, nullptr, &found) == 0) {
      freeaddrinfo(found);
    } else {
      *found_none = true;
    }
  }).detach();
}

std::string AddressLookup::error() const {
  return *found_none_ ? "the name " + host_ + " has no address" : "";
}

}  // namespace oblique::protocol
