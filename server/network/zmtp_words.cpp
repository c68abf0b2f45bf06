#include "server/network/zmtp_words.h"

#include <algorithm>
#include <array>

#include "server/network/curve/bytes.h"

namespace oblique::server {
namespace {

constexpr std::size_t kAsServerAt = 32;
constexpr std::size_t kLongestShort = 255;

std::string length_of(std::size_t bytes, unsigned flags) {
  std::string header;
  if (bytes <= kLongestShort) {
    header += static_cast<char>(flags);
    return header += static_cast<char>(bytes);
  }
  header += static_cast<char>(flags | kFrameLong);
  for (unsigned shift = 64; shift > 0;) {
    shift -= 8;
    header += static_cast<char>(bytes >> shift & 0xffU);
  }
  return header;
}

}  // namespace

std::string padded_mechanism(std::string_view name) {
  std::string padded(name);
  padded.resize(kMechanismBytes, '\0');
  return padded;
}

std::string greeting_of(std::string_view mechanism) {
  constexpr char kMinorVersion = 1;
  std::string bytes(kGreetingBytes, '\0');
  bytes[0] = '\xff';
  bytes[9] = '\x7f';
  bytes[10] = static_cast<char>(kOldestVersion);
  bytes[11] = kMinorVersion;
  bytes[kAsServerAt] = mechanism == "NULL" ? '\0' : '\1';
  return bytes.replace(kMechanismAt, kMechanismBytes, padded_mechanism(mechanism));
}

std::string zmtp_header(std::size_t body_bytes) {
  return length_of(body_bytes, 0);
}

std::string command_of(std::string_view name, std::string_view data) {
  std::string bytes = length_of(1 + name.size() + data.size(), kFrameCommand);
  bytes += static_cast<char>(name.size());
  bytes += name;
  return bytes += data;
}

std::string own_properties() {
  constexpr std::string_view kName = "Socket-Type";
  constexpr std::string_view kValue = "ROUTER";
  std::string property;
  property += static_cast<char>(kName.size());
  property += kName;
  property += std::string("\0\0\0", 3);
  property += static_cast<char>(kValue.size());
  return property += kValue;
}

std::string objection_to_properties(std::string_view properties) {
  constexpr std::size_t kLengthBytes = 4;
  std::string_view socket_type;
  while (!properties.empty()) {
    const std::size_t name_bytes = static_cast<unsigned char>(properties.front());
    if (properties.size() < 1 + name_bytes + kLengthBytes) {
      return "its properties are cut off";
    }
    const std::string_view name = properties.substr(1, name_bytes);
    const std::uint64_t value_bytes = number_of(properties.substr(1 + name_bytes, kLengthBytes));
    properties.remove_prefix(1 + name_bytes + kLengthBytes);
    if (properties.size() < value_bytes) {
      return "its properties are cut off";
    }
    if (name == "Socket-Type") {
      socket_type = properties.substr(0, static_cast<std::size_t>(value_bytes));
    }
    properties.remove_prefix(static_cast<std::size_t>(value_bytes));
  }
  constexpr std::array<std::string_view, 3> kAllowed{"DEALER", "REQ", "ROUTER"};
  if (std::find(kAllowed.begin(), kAllowed.end(), socket_type) == kAllowed.end()) {
    return "its socket is of a kind that does not speak with a ROUTER";
  }
  return "";
}

}  // namespace oblique::server
