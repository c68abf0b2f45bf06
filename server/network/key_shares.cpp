#include "server/network/key_shares.h"

#include <spdlog/fmt/fmt.h>

namespace oblique::server {

KeyShare& KeyShares::join(const protocol::CurveKey& key,
                          const std::shared_ptr<const KeyHolder>& holder) {
  KeyShare& share = shares_[key];
  share.holder = holder;
  ++share.connections;
  return share;
}

void KeyShares::leave(const protocol::CurveKey& key) {
  const auto share = shares_.find(key);
  if (--share->second.connections == 0) {
    shares_.erase(share);
  }
}

std::size_t KeyShares::connections(const protocol::CurveKey& key) const {
  const auto share = shares_.find(key);
  return share == shares_.end() ? 0 : share->second.connections;
}

Verdict BoundedDoorkeeper::judge(const protocol::CurveKey& public_key) const {
  Verdict verdict = inner_->judge(public_key);
  const auto* const holder = std::get_if<std::shared_ptr<const KeyHolder>>(&verdict);
  if (holder != nullptr && shares_.connections(public_key) >= most_connections_) {
    return Refusal{RefusalCause::kBound,
                   fmt::format("the key \"{}\" has {} connections already, as many as a key may",
                               (*holder)->name, most_connections_)};
  }
  return verdict;
}

}  // namespace oblique::server
