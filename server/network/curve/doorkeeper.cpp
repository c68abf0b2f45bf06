#include "server/network/curve/doorkeeper.h"

#include <array>
#include <utility>

namespace oblique::server {

std::string_view name_of(RefusalCause cause) {
  constexpr std::array<std::string_view, kRefusalCauses> kNames{
      "unknown key",      "revoked key",     "key of another role",
      "wrong server key", "other mechanism", "more than may be",
      "too slow",         "faulty"};
  return kNames.at(static_cast<std::size_t>(cause));
}

PortGuard::PortGuard(const protocol::KeyPair& server, std::shared_ptr<const Doorkeeper> keeper)
    : server_secret(server.secret_key),
      server_public(server.public_key),
      doorkeeper(std::move(keeper)) {}

}  // namespace oblique::server
