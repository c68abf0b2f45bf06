#include "server/network/peer_address.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string_view>

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include <spdlog/fmt/fmt.h>

namespace oblique::server {

PeerAddress::PeerAddress(const std::string& address, std::uint16_t port) {
  auto* const v4 = reinterpret_cast<sockaddr_in*>(&address_);
  if (inet_pton(AF_INET, address.c_str(), &v4->sin_addr) == 1) {
    v4->sin_family = AF_INET;
    v4->sin_port = htons(port);
    return;
  }
  const bool has_brackets = address.size() > 2 && address.front() == '[' && address.back() == ']';
  const std::string bare = has_brackets ? address.substr(1, address.size() - 2) : address;
  addrinfo wanted{};
  wanted.ai_flags = AI_NUMERICHOST;
  wanted.ai_family = AF_INET6;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(bare.c_str(), nullptr, &wanted, &found) != 0) {
    throw std::runtime_error(address + " is no numeric address");
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owned(found, &freeaddrinfo);
  std::memcpy(&address_, found->ai_addr, found->ai_addrlen);
  address_.sin6_port = htons(port);
}

std::string PeerAddress::text() const {
  constexpr std::string_view kMapped = "::ffff:";
  std::array<char, NI_MAXHOST> host{};
  std::array<char, NI_MAXSERV> port{};
  getnameinfo(system(), bytes(), host.data(), host.size(), port.data(), port.size(),
              NI_NUMERICHOST | NI_NUMERICSERV);
  const std::string_view digits = host.data();
  if (!is_v6()) {
    return fmt::format("{}:{}", digits, port.data());
  }
  return IN6_IS_ADDR_V4MAPPED(&address_.sin6_addr) && digits.starts_with(kMapped)
             ? fmt::format("{}:{}", digits.substr(kMapped.size()), port.data())
             : fmt::format("[{}]:{}", digits, port.data());
}

PeerAddress::Source PeerAddress::source() const {
  constexpr std::size_t kV4At = 12;
  Source source{};
  const std::uint8_t* const v6 = address_.sin6_addr.s6_addr;
  if (!is_v6()) {
    const auto* const v4 = reinterpret_cast<const sockaddr_in*>(&address_);
    std::memcpy(source.data() + kV4At, &v4->sin_addr, sizeof v4->sin_addr);
  } else if (IN6_IS_ADDR_V4MAPPED(&address_.sin6_addr)) {
    std::copy_n(v6 + kV4At, source.size() - kV4At, source.begin() + kV4At);
  } else {
    std::copy_n(v6, source.size() / 2, source.begin());
  }
  return source;
}

}  // namespace oblique::server
