#include "proto/address.h"

#include <charconv>
#include <string_view>

namespace oblique::protocol {

std::string objection_to_address(const std::string& url) {
  constexpr std::string_view kScheme = "tcp://";
  constexpr int kHighestPort = 65535;
  if (!url.starts_with(kScheme)) {
    return {};
  }
  const std::size_t colon = url.rfind(':');
  int port = 0;
  const auto [end, error] = std::from_chars(url.data() + colon + 1, url.data() + url.size(), port);
  const bool is_number = error == std::errc() && end == url.data() + url.size();
  return is_number && port >= 1 && port <= kHighestPort
             ? ""
             : "its port must be a number from 1 to 65535";
}

}  // namespace oblique::protocol
