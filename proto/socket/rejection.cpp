#include "proto/socket/rejection.h"

#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/socket/socket.h"

namespace oblique::protocol {
namespace {

/// The key that was shown, and the file that it is from.
std::string key_of(const DealerSettings& settings) {
  return fmt::format("{}, a {}'s key called \"{}\", public key {}", settings.key->path,
                     name_of(settings.key->role), settings.key->name,
                     z85(settings.key->pair.public_key));
}

/// A server says the same of keys that it does not know and of such for its other port, which the
/// address does not show unless its port is the usual one of this program.
std::string unknown_key(const DealerSettings& settings) {
  constexpr std::string_view kWorkersPort = "7601";
  constexpr std::string_view kClientsPort = "7600";
  const std::string_view ours = settings.is_worker ? kWorkersPort : kClientsPort;
  const std::string_view others = settings.is_worker ? kClientsPort : kWorkersPort;
  const std::string_view port = std::string_view(settings.url).substr(settings.url.rfind(':') + 1);
  const std::string perhaps_other_port =
      port == ours
          ? ""
          : fmt::format(
                "either port {} is the server's port for {} (by default {}), and {} use another "
                "one ({}); or ",
                port, settings.is_worker ? "clients" : "workers", others,
                settings.is_worker ? "workers" : "clients", ours);
  return fmt::format(
      "{}the key is not on the server's list, or was revoked. Where the server is, `oblique keys "
      "list` shows the list and `oblique keys add` adds to it",
      perhaps_other_port);
}

std::string refused_key(const DealerSettings& settings) {
  const bool is_for_workers = settings.key->role == Role::kWorker;
  const std::string why = is_for_workers == settings.is_worker
                              ? unknown_key(settings)
                              : fmt::format("it is for {}, and this port is for {}",
                                            is_for_workers ? "workers" : "clients",
                                            settings.is_worker ? "workers" : "clients");
  return fmt::format("the server at {} did not accept this key ({}): {}", settings.url,
                     key_of(settings), why);
}

}  // namespace

std::string sentence_of(Rejection rejection, const DealerSettings& settings) {
  const bool has_key = settings.key.has_value();
  switch (rejection) {
    case Rejection::kKey:
      return has_key ? refused_key(settings)
                     : fmt::format("the server at {} did not accept this program", settings.url);
    case Rejection::kServersKey:
      return has_key ? fmt::format(
                           "the server at {} did not accept this key ({}): the public key of the "
                           "server in that file, {}, is not its own, which its log says at the "
                           "start",
                           settings.url, key_of(settings),
                           z85(settings.key->server.value_or(CurveKey{})))
                     : fmt::format("the server at {} did not accept this program", settings.url);
    case Rejection::kOtherMechanism:
      return has_key ? fmt::format(
                           "the server at {} has no keys, and so did not accept this key ({}): "
                           "start it with --keys, or leave --keys and OBLIQUE_KEYS out here to "
                           "speak with it unencrypted",
                           settings.url, key_of(settings))
                     : fmt::format(
                           "the server at {} asks for a key, and none was given: say where yours "
                           "is with --keys FILE or OBLIQUE_KEYS",
                           settings.url);
    case Rejection::kForNow:
      return fmt::format(
          "the server at {} has no room at present: it, or this key, has as many connections as it "
          "may have",
          settings.url);
    case Rejection::kNoServer:
      break;
  }
  return fmt::format(
      "what answers at {} does not speak as oblique-server does: check the address and port",
      settings.url);
}

}  // namespace oblique::protocol
