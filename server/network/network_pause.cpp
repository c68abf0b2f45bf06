// Who is not read while more has come than is taken.
#include <algorithm>
#include <utility>

#include "server/network/network.h"

namespace oblique::server {

bool Network::has_more() const {
  return has_unopened_ || !handshakes_.empty() ||
         std::any_of(ports_.begin(), ports_.end(), [this](const OpenPort& port) {
           return !port.paused.empty() && !is_full(port);
         });
}

bool Network::has_unheard(const std::string& identity) const {
  const Peer* const peer = find(identity);
  return peer != nullptr && (peer->stands_in_line || peer->is_paused);
}

void Network::read_paused_again() {
  for (OpenPort& port : ports_) {
    if (port.paused.empty() || is_full(port)) {
      continue;
    }
    for (const Number number : std::exchange(port.paused, {})) {
      if (const auto found = peers_.find(number); found != peers_.end()) {
        found->second->is_paused = false;
        settle(number, *found->second);
      }
    }
  }
}

}  // namespace oblique::server
