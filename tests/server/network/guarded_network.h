#pragma once

#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "server/network/network.h"
#include "tests/server/network/list_doorkeeper.h"
#include "tests/server/network/turning.h"

namespace oblique::server {

/// A network with one port that wants keys and one that takes everybody, turned by hand.
class GuardedNetworkTest : public testing::Test {
 protected:
  explicit GuardedNetworkTest(NetworkLimits limits = {}) : network_(limits) {
    guarded_ = network_.listen("127.0.0.1", "*", PortGuard(server_, doorkeeper_));
    open_ = network_.listen("127.0.0.1", "*");
    doorkeeper_->admit(worker_.public_key, "anna");
  }

  /// Turns until `done`; a network that never gets there fails the test.
  template <typename Done>
  void turn_until(const Done& done) {
    ASSERT_TRUE(server::turn_until(network_, now_ms_, done));
  }
  Incoming next() {
    std::optional<Incoming> incoming;
    turn_until([&] { return (incoming = network_.next(guarded_, anybody)).has_value(); });
    return incoming ? std::move(*incoming) : Incoming{};
  }
  static bool anybody(const std::string&) { return true; }
  std::uint64_t refused(RefusalCause cause) const {
    return network_.refusals().at(static_cast<std::size_t>(cause)).count;
  }

  std::int64_t now_ms_ = 1000;
  protocol::KeyPair server_ = protocol::made_key_pair();
  protocol::KeyPair worker_ = protocol::made_key_pair();
  std::shared_ptr<ListDoorkeeper> doorkeeper_ = std::make_shared<ListDoorkeeper>();
  Network network_;
  Network::Port guarded_ = 0;
  Network::Port open_ = 0;
};

}  // namespace oblique::server
