#include "server/doors/listening.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <spdlog/fmt/fmt.h>

#include "proto/system/descriptor.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// What is written for an address, as a number; other text stays.
std::string numeric(const std::string& address) {
  if (address == "localhost") {
    return "127.0.0.1";
  }
  if (address == "*") {
    const protocol::Descriptor v6(::socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, IPPROTO_TCP));
    return v6.is_open() ? "::" : "0.0.0.0";
  }
  return address;
}

enum class Reach { kNone, kThisMachine, kNetwork };

Reach reach_of(const std::string& address) {
  in_addr v4{};
  in6_addr v6{};
  if (inet_pton(AF_INET, address.c_str(), &v4) == 1) {
    return (ntohl(v4.s_addr) >> 24U) == 127 ? Reach::kThisMachine : Reach::kNetwork;
  }
  // A link-local one may name its interface, as fe80::1%eth0.
  if (inet_pton(AF_INET6, address.substr(0, address.find('%')).c_str(), &v6) == 1) {
    return IN6_IS_ADDR_LOOPBACK(&v6) ? Reach::kThisMachine : Reach::kNetwork;
  }
  return Reach::kNone;
}

}  // namespace

std::string_view name_of(Access access) {
  switch (access) {
    case Access::kLoopback:
      return "loopback";
    case Access::kKeys:
      return "keys";
    case Access::kInsecure:
      break;
  }
  return "insecure";
}

Access access_of(const DoorSettings& settings) {
  if (!settings.keys.empty()) {
    return Access::kKeys;
  }
  return settings.insecure ? Access::kInsecure : Access::kLoopback;
}

std::string address_to_bind(const DoorSettings& settings) {
  if (!settings.keys.empty() && settings.insecure) {
    throw solver::InputError(
        "--keys and --insecure exclude each other: the one asks for keys, the other for none");
  }
  std::string address = numeric(settings.listen);
  const Reach reach = reach_of(address);
  if (reach == Reach::kNone) {
    throw solver::InputError(fmt::format(
        "--listen {} is no address: write a numeric one of this machine, as 127.0.0.1 or ::1, or "
        "* for all of them",
        protocol::visible(settings.listen)));
  }
  if (reach == Reach::kNetwork && access_of(settings) == Access::kLoopback) {
    throw solver::InputError(fmt::format(
        "--listen {} is refused: other machines reach that address, and there are no keys. Make "
        "keys with `oblique keygen DIR` and give --keys DIR/server.key, or give --insecure to let "
        "in whoever comes; without either the server listens on loopback only, as 127.0.0.1 or "
        "::1",
        settings.listen));
  }
  return address;
}

}  // namespace oblique::server
