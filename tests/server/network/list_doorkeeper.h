#pragma once

#include <map>
#include <memory>
#include <string>

#include "server/network/curve/doorkeeper.h"

namespace oblique::server {

/// Admits the keys that it was told of.
class ListDoorkeeper final : public Doorkeeper {
 public:
  void admit(const protocol::CurveKey& key, const std::string& name,
             protocol::Role role = protocol::Role::kWorker) {
    holders_[key] = std::make_shared<const KeyHolder>(KeyHolder{name, role});
  }
  void revoke(const protocol::CurveKey& key) { holders_.erase(key); }

  Verdict judge(const protocol::CurveKey& key) const override {
    const auto holder = holders_.find(key);
    if (holder == holders_.end()) {
      return Refusal{RefusalCause::kUnknownKey, "its key is not authorized"};
    }
    return holder->second;
  }

 private:
  std::map<protocol::CurveKey, std::shared_ptr<const KeyHolder>> holders_;
};

}  // namespace oblique::server
