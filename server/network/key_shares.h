#pragma once

#include <cstddef>
#include <map>
#include <memory>

#include "server/network/curve/doorkeeper.h"

namespace oblique::server {

/// What the connections of one key have together.
struct KeyShare {
  std::shared_ptr<const KeyHolder> holder;
  std::size_t connections = 0;
  std::size_t held_in_bytes = 0;      ///< of messages that are incomplete or not taken
  std::size_t waiting_out_bytes = 0;  ///< that the system has not taken yet
};

/// The keys that are connected at present.
class KeyShares {
 public:
  /// One more connection of that key. What is returned stays where it is until its last `leave`.
  KeyShare& join(const protocol::CurveKey& key, const std::shared_ptr<const KeyHolder>& holder);
  /// One less. What it held must have been taken out of the sums.
  void leave(const protocol::CurveKey& key);

  std::size_t connections(const protocol::CurveKey& key) const;
  const std::map<protocol::CurveKey, KeyShare>& all() const { return shares_; }

 private:
  std::map<protocol::CurveKey, KeyShare> shares_;
};

/// Admits whom another doorkeeper admits, as long as the key has room for one connection more.
class BoundedDoorkeeper final : public Doorkeeper {
 public:
  /// `shares` must outlive this.
  BoundedDoorkeeper(std::shared_ptr<const Doorkeeper> inner, const KeyShares& shares,
                    std::size_t most_connections)
      : inner_(std::move(inner)), shares_(shares), most_connections_(most_connections) {}
  Verdict judge(const protocol::CurveKey& public_key) const override;

 private:
  std::shared_ptr<const Doorkeeper> inner_;
  const KeyShares& shares_;
  std::size_t most_connections_;
};

}  // namespace oblique::server
