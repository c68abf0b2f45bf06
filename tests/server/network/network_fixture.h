#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <unistd.h>

#include "server/network/network.h"
#include "tests/server/network/curve_client.h"
#include "tests/support/hang_limit.h"

namespace oblique::server {

/// A TCP connection with the client's end of CURVE.
struct KeyedPeer {
  KeyedPeer(const std::string& endpoint, const CurveClient& keys, const char* source)
      : tcp(endpoint, source), curve(keys) {}
  void say_hello() { tcp.send(curve_greeting() + command_frame("HELLO", curve.hello())); }

  RawPeer tcp;
  CurveClient curve;
};

/// A network with a port that needs keys and one that does not, driven by the test.
class NetworkFixture : public testing::Test {
 protected:
  explicit NetworkFixture(NetworkLimits limits = {}) : network_(limits) {
    keyed_ = network_.listen("127.0.0.1", "*", PortSecurity{server_, authenticator_});
    open_ = network_.listen("127.0.0.1", "*");
    authenticator_->add(worker_.public_key, "anna");
  }

  /// Runs the network until `done`; one that never gets there fails the test.
  template <typename Done>
  void run_until(const Done& done) {
    const auto give_up = std::chrono::steady_clock::now() + test::kHangLimit;
    while (!done()) {
      ASSERT_LT(std::chrono::steady_clock::now(), give_up);
      network_.collect(now_ms_);
      if (!network_.has_more()) {
        usleep(1000);
      }
    }
  }
  Incoming next(Network::Port port) {
    std::optional<Incoming> incoming;
    network_.collect(now_ms_);
    run_until([&] { return (incoming = network_.next(port, anybody)).has_value(); });
    return incoming ? std::move(*incoming) : Incoming{};
  }
  static bool anybody(const std::string&) { return true; }
  std::uint64_t refused(RefusalCause cause) const {
    return network_.refusals().at(static_cast<std::size_t>(cause));
  }

  std::unique_ptr<RawPeer> open_peer() {
    auto peer = std::make_unique<RawPeer>(network_.endpoint(open_));
    peer->shake_hands();
    return peer;
  }
  std::unique_ptr<KeyedPeer> keyed_peer(const protocol::KeyPair& own,
                                        const protocol::CurveKey& server,
                                        const char* source = kHere) {
    return std::make_unique<KeyedPeer>(network_.endpoint(keyed_), CurveClient(own, server), source);
  }
  /// Runs the network until the peer has received so many bytes, and returns them.
  std::string received_by(KeyedPeer& peer, std::size_t bytes) {
    std::string received;
    run_until([&] { return (received += peer.tcp.receive_what_is_there()).size() >= bytes; });
    return received;
  }
  void take_welcome(KeyedPeer& peer) {
    const std::string received = received_by(peer, kWelcomedBytes);
    ASSERT_TRUE(peer.curve.take_welcome(std::string_view(received).substr(kGreetingBytes + 10)));
  }
  std::unique_ptr<KeyedPeer> admitted(const char* source = kHere) {
    auto peer = keyed_peer(worker_, server_.public_key, source);
    peer->say_hello();
    take_welcome(*peer);
    peer->tcp.send(command_frame("INITIATE", peer->curve.initiate()));
    static_cast<void>(received_by(*peer, 1));
    return peer;
  }

  static constexpr const char* kHere = "127.0.0.1";
  static constexpr const char* kElsewhere = "127.0.0.2";
  static constexpr std::size_t kWelcomedBytes = kGreetingBytes + 170;

  std::int64_t now_ms_ = 1000;
  protocol::KeyPair server_ = protocol::made_key_pair();
  protocol::KeyPair worker_ = protocol::made_key_pair();
  std::shared_ptr<ListAuthenticator> authenticator_ = std::make_shared<ListAuthenticator>();
  Network network_;
  Network::Port keyed_ = 0;
  Network::Port open_ = 0;
};

}  // namespace oblique::server
