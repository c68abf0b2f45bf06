#include "server/doors/doors.h"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

protocol::KeyFile servers_key(const DoorSettings& settings) {
  protocol::KeyFile key = protocol::read_key_file(settings.keys);
  if (key.role != protocol::Role::kServer) {
    throw solver::InputError(fmt::format(
        "{} is the key of a {}: a server takes its own, as DIR/server.key of `oblique keygen "
        "DIR`, by --keys or OBLIQUE_SERVER_KEYS, which override OBLIQUE_KEYS",
        settings.keys, name_of(key.role)));
  }
  return key;
}

}  // namespace

Doors::Doors(const DoorSettings& settings)
    : address_(address_to_bind(settings)), access_(access_of(settings)) {
  if (access_ == Access::kKeys) {
    key_ = servers_key(settings);
    list_ = std::make_shared<KeyList>(protocol::authorized_keys_beside(settings.keys));
  }
}

std::optional<PortGuard> Doors::guard(PortKeeper::Port port) const {
  if (!key_) {
    return std::nullopt;
  }
  return PortGuard(key_->pair, std::make_shared<const PortKeeper>(list_, port));
}

Doors::News Doors::look(std::int64_t now_ms) {
  constexpr std::int64_t kLookEvery_ms = 500;
  constexpr std::int64_t kWarnEvery_ms = 600'000;
  News news;
  if (key_ && !std::exchange(is_introduced_, true)) {
    news.lines.push_back(
        {false, fmt::format("admits the {} keys of {}; its own public key is {}", list_->size(),
                            list_->path(), protocol::z85(key_->pair.public_key))});
  }
  if (list_ && now_ms >= next_look_ms_) {
    next_look_ms_ = now_ms + kLookEvery_ms;
    if (auto found = list_->look()) {
      news.admission_changed = found->admission_changed;
      news.lines.push_back({found->is_fault, std::move(found->text)});
    }
  }
  if (access_ == Access::kInsecure && now_ms >= next_warning_ms_) {
    next_warning_ms_ = now_ms + kWarnEvery_ms;
    news.lines.push_back(
        {true, fmt::format("INSECURE: whoever reaches {} can submit, cancel and read studies and "
                           "store false results, and all is sent as plain text, for the server was "
                           "started with --insecure. `oblique keygen` makes keys",
                           address_)});
  }
  return news;
}

}  // namespace oblique::server
